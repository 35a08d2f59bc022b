#include "place/vocabulary.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "base/assert.h"
#include "base/memory_count.h"
#include "feature/hamming.h"
#include "place/content_hash.h"

namespace bslam::place {
namespace {

// Checks everything that can be checked without building the tree. The keys in errors are those of the file format.
Status check_numbers(const VocabularyContent& c) {
  const bool printable = std::all_of(c.kind.begin(), c.kind.end(), [](char k) { return k > ' ' && k <= '~'; });
  if (c.kind.empty() || c.kind.size() > 64 || !printable) {
    return Error{"", "kind", "invalid name of a descriptor kind", "1 to 64 printable characters"};
  }
  if (c.branching < 2 || c.branching > kMaxBranching) {
    return Error{"", "branching", std::to_string(c.branching), "2 to " + std::to_string(kMaxBranching)};
  }
  if (c.levels < 1 || c.levels > kMaxLevels) {
    return Error{"", "levels", std::to_string(c.levels), "1 to " + std::to_string(kMaxLevels)};
  }
  const std::size_t nodes = c.child_count.size();
  if (nodes < 2 || nodes > kMaxNodes) {
    return Error{"", "nodes", std::to_string(nodes), "2 to " + std::to_string(kMaxNodes)};
  }
  if (c.descriptor.size() != nodes - 1) {
    return Error{"", "descriptors", std::to_string(c.descriptor.size()), std::to_string(nodes - 1)};
  }
  for (std::size_t w = 0; w < c.weight.size(); ++w) {
    if (!(std::isfinite(c.weight[w]) && c.weight[w] >= 0)) {
      return Error{"", "weight of word " + std::to_string(w), std::to_string(c.weight[w]),
                   "a finite number, 0 or more"};
    }
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<const Vocabulary>> Vocabulary::make(VocabularyContent content) {
  if (const Status s = check_numbers(content); !s) return s.error();
  // make_shared cannot call the private constructor
  std::shared_ptr<Vocabulary> vocabulary(new Vocabulary(std::move(content)));
  if (const Status s = vocabulary->link(); !s) return s.error();
  vocabulary->id_ = vocabulary->hash();
  return std::shared_ptr<const Vocabulary>(std::move(vocabulary));
}

// Computes nodes_ and depth_ from the numbers of children.
Status Vocabulary::link() {
  const std::size_t nodes = num_nodes();
  nodes_.resize(nodes);
  std::size_t next = 1;       // first node that is not yet a child of another node
  std::size_t level_end = 1;  // first node of the next level
  std::size_t words = 0;
  for (std::size_t i = 0; i < nodes; ++i) {
    if (i == next) return Error{"", "node " + std::to_string(i), "no parent", "a child of an earlier node"};
    if (i == level_end) {
      ++depth_;
      level_end = next;
    }
    const std::size_t count = content_.child_count[i];
    if (count > static_cast<std::size_t>(content_.branching)) {
      return Error{"", "node " + std::to_string(i), std::to_string(count) + " children",
                   "at most " + std::to_string(content_.branching)};
    }
    if (count > nodes - next)
      return Error{"", "node " + std::to_string(i), "children beyond the last node", "fewer children"};
    nodes_[i] = {static_cast<std::int32_t>(count > 0 ? next : words++), static_cast<std::int32_t>(count)};
    next += count;
  }
  if (depth_ > content_.levels) {
    return Error{"", "levels", std::to_string(depth_), "at most " + std::to_string(content_.levels)};
  }
  if (words != size()) return Error{"", "weights", std::to_string(size()), std::to_string(words) + ", one per word"};
  return {};
}

std::uint64_t Vocabulary::hash() const {
  ContentHash hash;
  for (const char c : kind()) hash.add(static_cast<unsigned char>(c));
  for (const int n : {branching(), levels()}) hash.add(static_cast<std::uint64_t>(n));
  hash.add(num_nodes());
  for (const std::uint8_t count : content_.child_count) hash.add(count);
  for (const feature::Descriptor& d : content_.descriptor) {
    for (const std::uint64_t bits : d) hash.add(bits);
  }
  for (const float w : content_.weight) hash.add(std::bit_cast<std::uint32_t>(w));
  return hash.value();
}

// Packs distance and child index into one number, so that the minimum is the nearest child, the first one on ties.
inline std::int32_t Vocabulary::nearest_child(const Node& node, const feature::Descriptor& descriptor) const {
  const feature::Descriptor* child = content_.descriptor.data() + (node.first - 1);
  std::int32_t best = (feature::hamming(descriptor, child[0]) << 8);
  for (std::int32_t k = 1; k < node.count; ++k) {
    best = std::min(best, (feature::hamming(descriptor, child[k]) << 8) | k);
  }
  return node.first + (best & 0xff);
}

WordId Vocabulary::word(const feature::Descriptor& descriptor) const {
  const Node* node = nodes_.data();
  while (node->count > 0) node = nodes_.data() + nearest_child(*node, descriptor);
  return WordId(node->first);
}

// Descends with a group of descriptors at the same time, so that the memory of one is prefetched while the others are
// compared.
void Vocabulary::words(std::span<const feature::Descriptor> descriptors, std::span<WordId> words) const {
  BSLAM_ASSERT(descriptors.size() == words.size(), "the numbers of words and descriptors must be equal");
  constexpr std::size_t kBatch = 32;
  constexpr std::size_t kCacheLine = 64;
  std::array<Node, kBatch> at;
  for (std::size_t begin = 0; begin < words.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, words.size() - begin);
    at.fill(nodes_.front());
    std::array<std::int32_t, kBatch> next{};
    for (int step = 0; step < depth_; ++step) {
      for (std::size_t i = 0; i < count; ++i) {
        if (at[i].count == 0) continue;
        next[i] = nearest_child(at[i], descriptors[begin + i]);
        __builtin_prefetch(nodes_.data() + next[i]);
      }
      for (std::size_t i = 0; i < count; ++i) {
        if (at[i].count == 0) continue;
        at[i] = nodes_[static_cast<std::size_t>(next[i])];
        if (at[i].count == 0) continue;
        const auto* child = reinterpret_cast<const char*>(content_.descriptor.data() + (at[i].first - 1));
        const std::size_t bytes = static_cast<std::size_t>(at[i].count) * sizeof(feature::Descriptor);
        for (std::size_t offset = 0; offset < bytes; offset += kCacheLine) __builtin_prefetch(child + offset);
      }
    }
    for (std::size_t i = 0; i < count; ++i) words[begin + i] = WordId(at[i].first);
  }
}

std::size_t Vocabulary::memory_bytes() const {
  return sizeof(Vocabulary) + bslam::memory_bytes(content_.child_count) + bslam::memory_bytes(content_.descriptor) +
         bslam::memory_bytes(content_.weight) + bslam::memory_bytes(nodes_);
}

}  // namespace bslam::place
