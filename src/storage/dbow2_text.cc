#include "storage/dbow2_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/vocabulary_file.h"

namespace bslam::storage {
namespace {

constexpr std::size_t kBytes = sizeof(feature::Descriptor);

// A node as described by its line. Node 0 is the root, which has no line.
struct TextNode {
  std::int32_t parent = -1;
  std::int32_t level = 0;
  std::int32_t children = 0;
  bool is_leaf = false;
  float weight = 0;
  feature::Descriptor descriptor{};
};

class Words {  // the words of a line, separated by blanks
 public:
  explicit Words(std::string_view line) : rest_(line) {}

  std::string_view next() {
    const std::size_t begin = rest_.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return rest_ = {};
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(word.size());
    return word;
  }

  std::size_t count() const {
    Words copy = *this;
    std::size_t n = 0;
    while (!copy.next().empty()) ++n;
    return n;
  }

 private:
  static constexpr std::string_view kBlanks = " \t\r";
  std::string_view rest_;
};

// Parses the complete word as a number within limits.
template <class T>
std::optional<T> number(std::string_view word, T low, T high) {
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !(value >= low && value <= high)) return std::nullopt;
  return value;
}

std::string_view take_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

Error at_line(std::size_t line, std::string found, std::string expected) {
  return {"", "line " + std::to_string(line), std::move(found), std::move(expected)};
}

struct Shape {
  std::int32_t branching = 0, levels = 0;
};

Result<Shape> parse_shape(std::string_view line) {
  Words words(line);
  const auto branching = number<std::int32_t>(words.next(), 2, place::kMaxBranching);
  const auto levels = number<std::int32_t>(words.next(), 1, place::kMaxLevels);
  const auto scoring = number<std::int32_t>(words.next(), 0, 5), weighting = number<std::int32_t>(words.next(), 0, 3);
  if (!branching || !levels || !scoring || !weighting || words.count() > 0) {
    return at_line(1, "an invalid first line",
                   "branching (2 to " + std::to_string(place::kMaxBranching) + "), levels (1 to " +
                       std::to_string(place::kMaxLevels) + "), scoring (0 to 5), weighting (0 to 3)");
  }
  return Shape{*branching, *levels};
}

// Parses the line of a node and checks that it can be added to the preceding nodes.
Result<TextNode> parse_node(std::string_view text, std::size_t line, const Shape& shape,
                            const std::vector<TextNode>& nodes) {
  Words words(text);
  if (const std::size_t count = words.count(); count != kBytes + 3) {
    return at_line(line, std::to_string(count) + " numbers", "parent, is_leaf, a descriptor of 32 bytes, weight");
  }
  TextNode node;
  const auto parent = number<std::int32_t>(words.next(), 0, static_cast<std::int32_t>(nodes.size()) - 1);
  if (!parent) return at_line(line, "an invalid parent", "an earlier node: 0 to " + std::to_string(nodes.size() - 1));
  const TextNode& above = nodes[static_cast<std::size_t>(*parent)];
  if (above.is_leaf) return at_line(line, "a parent that is a leaf", "an inner node");
  if (above.children == shape.branching)
    return at_line(line, "too many children of one parent", "at most " + std::to_string(shape.branching));
  if (above.level == shape.levels)
    return at_line(line, "a node below the deepest level", "at most " + std::to_string(shape.levels));
  const auto is_leaf = number<int>(words.next(), 0, 1);
  if (!is_leaf) return at_line(line, "an invalid is_leaf", "0 or 1");
  for (std::size_t i = 0; i < kBytes; ++i) {
    const auto byte = number<int>(words.next(), 0, 255);
    if (!byte) return at_line(line, "an invalid descriptor", "32 numbers from 0 to 255");
    node.descriptor[i / 8] |= static_cast<std::uint64_t>(*byte) << (8 * (i % 8));
  }
  const auto weight = number<double>(words.next(), 0.0, std::numeric_limits<float>::max());
  if (!weight) return at_line(line, "an invalid weight", "a non-negative number");
  node.parent = *parent;
  node.level = above.level + 1;
  node.is_leaf = *is_leaf == 1;
  node.weight = static_cast<float>(*weight);
  return node;
}

// Returns the nodes in breadth-first order, with the children of a node in the order of their lines.
place::VocabularyContent arrange(const std::vector<TextNode>& nodes, const Shape& shape) {
  std::vector<std::size_t> first(nodes.size() + 1, 0);  // index in `children` of the first child of a node
  for (std::size_t i = 0; i < nodes.size(); ++i) first[i + 1] = first[i] + static_cast<std::size_t>(nodes[i].children);
  std::vector<std::size_t> children(nodes.size() - 1), at = first;
  for (std::size_t i = 1; i < nodes.size(); ++i) children[at[static_cast<std::size_t>(nodes[i].parent)]++] = i;
  place::VocabularyContent content;
  content.kind = kDbow2Kind;
  content.branching = shape.branching;
  content.levels = shape.levels;
  std::vector<std::size_t> queue{0};
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const std::size_t i = queue[q];
    content.child_count.push_back(static_cast<std::uint8_t>(nodes[i].children));
    if (i > 0) content.descriptor.push_back(nodes[i].descriptor);
    if (nodes[i].is_leaf) content.weight.push_back(nodes[i].weight);
    for (std::size_t c = first[i]; c < first[i + 1]; ++c) queue.push_back(children[c]);
  }
  return content;
}

}  // namespace

bool is_dbow2_text(std::string_view text) {
  Words words(take_line(text));
  for (int i = 0; i < 4; ++i) {
    if (!number<std::int64_t>(words.next(), 0, std::numeric_limits<std::int64_t>::max())) return false;
  }
  return words.count() == 0;
}

Result<place::VocabularyPtr> parse_dbow2_text(std::string_view text) {
  text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
  const auto shape = parse_shape(take_line(text));
  if (!shape) return shape.error();
  std::vector<TextNode> nodes(1);
  std::size_t line = 1;
  while (!text.empty()) {
    ++line;
    if (nodes.size() == place::kMaxNodes)
      return at_line(line, "too many nodes", "at most " + std::to_string(place::kMaxNodes));
    const auto node = parse_node(take_line(text), line, *shape, nodes);
    if (!node) return node.error();
    ++nodes[static_cast<std::size_t>(node->parent)].children;
    nodes.push_back(*node);
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].is_leaf && nodes[i].children == 0) return at_line(i + 1, "an inner node without children", "a leaf");
  }
  return place::Vocabulary::make(arrange(nodes, *shape));
}

}  // namespace bslam::storage
