// A vector whose copies share memory, chunk by chunk, until one of them is changed (copy on write).
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace bslam::map {

// Copies cost one shared pointer per chunk. Reading a const CowVector from several threads is safe; changing one is safe
// as long as no other thread uses that very object.
template <class T, std::size_t kChunk>
class CowVector {
 public:
  std::size_t size() const { return size_; }
  const T& operator[](std::size_t i) const { return (*chunks_[i / kChunk])[i % kChunk]; }

  // For writing: detaches the chunk of element i first where another copy shares it.
  T& mutate(std::size_t i) {
    std::shared_ptr<Chunk>& chunk = chunks_[i / kChunk];
    if (chunk.use_count() != 1) chunk = std::make_shared<Chunk>(*chunk);
    return (*chunk)[i % kChunk];
  }

  void push_back(T value) {
    if (size_ % kChunk == 0) chunks_.push_back(std::make_shared<Chunk>());
    ++size_;
    mutate(size_ - 1) = std::move(value);
  }

 private:
  using Chunk = std::array<T, kChunk>;
  std::vector<std::shared_ptr<Chunk>> chunks_;
  std::size_t size_ = 0;
};

}  // namespace bslam::map
