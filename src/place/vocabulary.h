// The vocabulary of place recognition: a tree of binary descriptors whose leaves are visual words (Nister and
// Stewenius, CVPR 2006; of binary descriptors: Galvez-Lopez and Tardos, T-RO 2012).
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

// What our extractor describes with: the bits mean the tests of feature::make_binary_tests. Changes when they do.
constexpr std::string_view kDescriptorKind = "orb256-bslam";

// What a vocabulary is made of. Nodes are in breadth-first order, node 0 the root; the children of a node follow those
// of the node before it, so that their numbers alone tell the tree. A node without children is a word; words are
// numbered in the order of their nodes.
struct VocabularyContent {
  std::string kind{kDescriptorKind};            // of the descriptors: 1 to 64 printable ASCII characters
  int branching = 0;                            // most children a node has, 2 to kMaxBranching
  int levels = 0;                               // most steps from the root to a word, 1 to kMaxLevels
  std::vector<std::uint8_t> child_count;        // per node
  std::vector<feature::Descriptor> descriptor;  // per node but the root: entry i is of node i + 1
  std::vector<float> weight;                    // per word: inverse document frequency, finite, not negative
};

constexpr int kMaxBranching = 64;
constexpr int kMaxLevels = 12;
constexpr std::size_t kMaxNodes = std::size_t{1} << 24;

// Immutable; shared by pointer.
class Vocabulary {
 public:
  // Errors name the part of the content that contradicts itself.
  static Result<std::shared_ptr<const Vocabulary>> make(VocabularyContent content);

  // The word reached from the root by the child nearest in Hamming distance; of equally near ones the first.
  WordId word(const feature::Descriptor& descriptor) const;

  // words[i] = word(descriptors[i]), in a fraction of the time. The spans are of equal length.
  void words(std::span<const feature::Descriptor> descriptors, std::span<WordId> words) const;

  float weight(WordId word) const { return content_.weight[word.index()]; }
  std::size_t size() const { return content_.weight.size(); }            // words
  std::size_t num_nodes() const { return content_.child_count.size(); }  // the root among them
  int branching() const { return content_.branching; }
  int levels() const { return content_.levels; }
  const std::string& kind() const { return content_.kind; }

  // Hash of the content: equal where two vocabularies give the same words and weights. Saved maps name it.
  std::uint64_t id() const { return id_; }

  const VocabularyContent& content() const { return content_; }

 private:
  struct Node {
    std::int32_t first;  // child; of a word, its id
    std::int32_t count;  // children; 0: a word
  };

  explicit Vocabulary(VocabularyContent content) : content_(std::move(content)) {}
  Status link();
  std::uint64_t hash() const;
  std::int32_t nearest_child(const Node& node, const feature::Descriptor& descriptor) const;

  VocabularyContent content_;
  std::vector<Node> nodes_;
  int depth_ = 0;  // steps to the deepest word
  std::uint64_t id_ = 0;
};

using VocabularyPtr = std::shared_ptr<const Vocabulary>;

}  // namespace bslam::place
