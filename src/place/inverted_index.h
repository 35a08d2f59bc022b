// Which keyframes show a word.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "base/id.h"
#include "place/word_vector.h"

namespace bslam::place {

struct CommonWords {
  KeyframeId keyframe;
  int count = 0;  // words it has in common with the query, at least 1
  friend bool operator==(const CommonWords&, const CommonWords&) = default;
};

// Keyframes by word. What it holds, and so every answer, depends on which keyframes are in it and not on the order in
// which they came.
class InvertedIndex {
 public:
  // `keyframe` is not in the index; `words` is not null.
  void add(KeyframeId keyframe, std::shared_ptr<const WordVector> words);
  void remove(KeyframeId keyframe);  // nothing where it is not in the index
  void clear();

  bool contains(KeyframeId keyframe) const { return keyframes_.contains(keyframe); }
  std::size_t size() const { return keyframes_.size(); }

  // Null where the keyframe is not in the index.
  std::shared_ptr<const WordVector> words_of(KeyframeId keyframe) const;

  // The keyframes that share a word with `words`, by id. Costs an addition for each pair of a word and a keyframe that
  // has it, and a pass over the ids up to the largest.
  std::vector<CommonWords> query(const WordVector& words) const;

 private:
  std::map<KeyframeId, std::shared_ptr<const WordVector>> keyframes_;
  std::vector<std::vector<KeyframeId>> by_word_;  // sorted
};

}  // namespace bslam::place
