// Copy-on-write vectors: copies share memory until one of them is modified.
//
// Every piece of memory carries the tag of the copy that created it. A copy modifies a piece in place only if the piece
// has its own tag; otherwise it creates a private piece. Reference counts determine lifetime only and never permission
// to write: a count of one, as read by one thread, does not exclude a race with reads of another thread just before it
// released the piece.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/assert.h"
#include "base/memory_count.h"

namespace bslam::map {

// The tag of one copy within a family of values that share pieces. Copying revokes the right of both sides to modify
// existing pieces in place, since all of them are shared afterwards; each side draws a new tag, unique in the family,
// at its next change. Copying is therefore safe from several threads at once, which is how drafts copy a published
// version.
class CowOwner {
 public:
  CowOwner() : family_(std::make_shared<std::atomic<std::uint64_t>>(0)) {}
  CowOwner(const CowOwner& other) : family_(other.family_) { other.share(); }
  CowOwner(CowOwner&& other) noexcept
      : family_(std::move(other.family_)), tag_(other.tag_), shared_(other.shared_.load(std::memory_order_relaxed)) {}
  CowOwner& operator=(const CowOwner& other) {
    if (this == &other) return *this;
    family_ = other.family_;
    other.share();
    share();
    return *this;
  }
  CowOwner& operator=(CowOwner&& other) noexcept {
    family_ = std::move(other.family_);
    tag_ = other.tag_;
    shared_.store(other.shared_.load(std::memory_order_relaxed), std::memory_order_relaxed);
    return *this;
  }
  ~CowOwner() = default;

  // The tag of pieces that may be modified in place. Only the owner that may modify the value calls this.
  std::uint64_t tag() {
    if (shared_.load(std::memory_order_relaxed)) {
      tag_ = family_->fetch_add(1, std::memory_order_relaxed) + 1;
      shared_.store(false, std::memory_order_relaxed);
    }
    return tag_;
  }

 private:
  void share() const {
    if (!shared_.load(std::memory_order_relaxed)) shared_.store(true, std::memory_order_relaxed);
  }

  std::shared_ptr<std::atomic<std::uint64_t>> family_;  // the last tag assigned
  std::uint64_t tag_ = 0;
  // Relaxed memory order suffices: a thread that copies or modifies a value obtained it through a synchronised path.
  // The flag is atomic because several threads may copy the same published value concurrently.
  mutable std::atomic<bool> shared_ = true;
};

// Two levels, nodes of chunks, so that a copy costs one shared pointer per 64 chunks. `tag` is the tag of the CowOwner
// that is stored and copied together with the vector.
template <class T, std::size_t kChunk>
class CowVector {
 public:
  std::size_t size() const { return size_; }
  const T& operator[](std::size_t i) const {
    return nodes_[i / kPerNode]->chunks[i / kChunk % kNode]->values[i % kChunk];
  }

  // Mutable access: detaches the chunk of element i unless this copy owns it.
  T& mutate(std::size_t i, std::uint64_t tag) {
    std::shared_ptr<Node>& node = nodes_[i / kPerNode];
    detach(node, tag);
    std::shared_ptr<Chunk>& chunk = node->chunks[i / kChunk % kNode];
    detach(chunk, tag);
    return chunk->values[i % kChunk];
  }

  // The memory of the pieces that were not counted before, and what their elements own: owned(element).
  template <class Owned>
  std::size_t memory_bytes(MemoryCount& count, const Owned& owned) const {
    std::size_t bytes = bslam::memory_bytes(nodes_);
    for (const std::shared_ptr<Node>& node : nodes_) {
      bytes += count.once(node.get(), sizeof(Node) + MemoryCount::kShared);
      for (const std::shared_ptr<Chunk>& chunk : node->chunks) {
        const std::size_t own = count.once(chunk.get(), sizeof(Chunk) + MemoryCount::kShared);
        if (own == 0) continue;
        bytes += own;
        for (const T& value : chunk->values) bytes += owned(value);
      }
    }
    return bytes;
  }

  // Releases the memory of a full chunk: its elements become default values in a piece shared by all such chunks.
  void blank_chunk(std::size_t chunk, std::uint64_t tag) {
    BSLAM_ASSERT((chunk + 1) * kChunk <= size_, "only a full chunk can be released");
    static const std::shared_ptr<Chunk> kBlank = std::make_shared<Chunk>(Chunk{kNoOwner, {}});
    if (nodes_[chunk / kNode]->chunks[chunk % kNode] == kBlank) return;
    detach(nodes_[chunk / kNode], tag);
    nodes_[chunk / kNode]->chunks[chunk % kNode] = kBlank;
  }

  void push_back(T value, std::uint64_t tag) {
    if (size_ % kPerNode == 0) nodes_.push_back(std::make_shared<Node>(Node{tag, {}}));
    if (size_ % kChunk == 0) {
      detach(nodes_.back(), tag);
      nodes_.back()->chunks[size_ / kChunk % kNode] = std::make_shared<Chunk>(Chunk{tag, {}});
    }
    ++size_;
    mutate(size_ - 1, tag) = std::move(value);
  }

 private:
  static constexpr std::uint64_t kNoOwner = ~std::uint64_t{0};  // a tag that is never assigned
  static constexpr std::size_t kNode = 64;                      // chunks per node
  static constexpr std::size_t kPerNode = kNode * kChunk;
  struct Chunk {
    std::uint64_t tag;
    std::array<T, kChunk> values;
  };
  struct Node {
    std::uint64_t tag;
    std::array<std::shared_ptr<Chunk>, kNode> chunks;
  };
  template <class Piece>
  static void detach(std::shared_ptr<Piece>& piece, std::uint64_t tag) {
    if (piece->tag == tag) return;
    piece = std::make_shared<Piece>(*piece);
    piece->tag = tag;
  }

  std::vector<std::shared_ptr<Node>> nodes_;
  std::size_t size_ = 0;
};

// A contiguous array that is shared and detached as a whole. Reads like a const std::vector.
template <class T>
class CowArray {
 public:
  CowArray() = default;
  CowArray(std::vector<T> values, std::uint64_t tag) : piece_(std::make_shared<Piece>(Piece{tag, std::move(values)})) {}

  const std::vector<T>& values() const { return piece_ ? piece_->values : kNone; }
  operator const std::vector<T>&() const { return values(); }  // NOLINT: implicit on purpose
  std::size_t size() const { return values().size(); }
  bool empty() const { return values().empty(); }
  const T& operator[](std::size_t i) const { return piece_->values[i]; }
  auto begin() const { return values().begin(); }
  auto end() const { return values().end(); }

  // The memory of the elements, unless it was counted before.
  std::size_t memory_bytes(MemoryCount& count) const {
    if (!piece_) return 0;
    return count.once(piece_.get(), sizeof(Piece) + MemoryCount::kShared + bslam::memory_bytes(piece_->values));
  }

  // Mutable access: detaches the array unless this copy owns it.
  std::vector<T>& mutate(std::uint64_t tag) {
    if (!piece_) {
      piece_ = std::make_shared<Piece>(Piece{tag, {}});
    } else if (piece_->tag != tag) {
      piece_ = std::make_shared<Piece>(*piece_);
      piece_->tag = tag;
    }
    return piece_->values;
  }
  void clear() { piece_.reset(); }

 private:
  struct Piece {
    std::uint64_t tag;
    std::vector<T> values;
  };
  static inline const std::vector<T> kNone;
  std::shared_ptr<Piece> piece_;
};

}  // namespace bslam::map
