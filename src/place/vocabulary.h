// The vocabulary for place recognition: a tree of binary descriptors whose leaves are the visual words (Nister and
// Stewenius, CVPR 2006; for binary descriptors: Galvez-Lopez and Tardos, T-RO 2012).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/id.h"
#include "base/result.h"
#include "feature/keypoints.h"

namespace bslam::place {

// Name of the descriptors computed by bslam's extractor. It must change whenever the pattern of
// feature::make_brief_pattern changes.
constexpr std::string_view kDescriptorKind = "orb256-bslam";

// The data of a vocabulary. Nodes are in breadth-first order, and node 0 is the root. The children of a node follow
// the children of the previous node, so the numbers of children define the tree. A node without children is a word;
// words are numbered in the order of their nodes.
struct VocabularyContent {
  std::string kind{kDescriptorKind};            // name of the descriptors: 1 to 64 printable ASCII characters
  int branching = 0;                            // maximum number of children, 2 to kMaxBranching
  int levels = 0;                               // maximum number of steps from the root to a word, 1 to kMaxLevels
  std::vector<std::uint8_t> child_count;        // per node
  std::vector<feature::Descriptor> descriptor;  // per node except the root: entry i belongs to node i + 1
  std::vector<float> weight;                    // per word: inverse document frequency, finite and non-negative
};

constexpr int kMaxBranching = 64;
constexpr int kMaxLevels = 12;
constexpr std::size_t kMaxNodes = std::size_t{1} << 24;

// Immutable; shared by pointer.
class Vocabulary {
 public:
  // Errors name the inconsistent field.
  static Result<std::shared_ptr<const Vocabulary>> make(VocabularyContent content);

  // Returns the word reached from the root by always taking the child nearest in Hamming distance; the first one on
  // ties.
  WordId word(const feature::Descriptor& descriptor) const;

  // Computes words[i] = word(descriptors[i]), much faster than one at a time. The spans must have equal length.
  void words(std::span<const feature::Descriptor> descriptors, std::span<WordId> words) const;

  float weight(WordId word) const { return content_.weight[word.index()]; }
  std::size_t size() const { return content_.weight.size(); }            // number of words
  std::size_t num_nodes() const { return content_.child_count.size(); }  // including the root
  int branching() const { return content_.branching; }
  int levels() const { return content_.levels; }
  const std::string& kind() const { return content_.kind; }

  // Hash of the content: two vocabularies with equal hashes give the same words and weights. Saved maps store it.
  std::uint64_t id() const { return id_; }

  const VocabularyContent& content() const { return content_; }

  std::size_t memory_bytes() const;

 private:
  struct Node {
    std::int32_t first;  // first child; for a word, its word id
    std::int32_t count;  // number of children; 0 for a word
  };

  explicit Vocabulary(VocabularyContent content) : content_(std::move(content)) {}
  Status link();
  std::uint64_t hash() const;
  std::int32_t nearest_child(const Node& node, const feature::Descriptor& descriptor) const;

  VocabularyContent content_;
  std::vector<Node> nodes_;
  int depth_ = 0;  // number of steps to the deepest word
  std::uint64_t id_ = 0;
};

using VocabularyPtr = std::shared_ptr<const Vocabulary>;

}  // namespace bslam::place
