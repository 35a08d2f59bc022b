// Inverted index: for each word, the keyframes that contain it.
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
  int count = 0;  // number of words shared with the query, 1 or more
  friend bool operator==(const CommonWords&, const CommonWords&) = default;
};

// The content, and therefore every result, depends on which keyframes were added, not on the order of adding.
class InvertedIndex {
 public:
  // The keyframe must not be in the index yet; `words` must not be null.
  void add(KeyframeId keyframe, std::shared_ptr<const WordVector> words);
  void remove(KeyframeId keyframe);  // does nothing if the keyframe is not in the index

  bool contains(KeyframeId keyframe) const { return keyframes_.contains(keyframe); }
  std::size_t size() const { return keyframes_.size(); }

  // Returns null if the keyframe is not in the index.
  std::shared_ptr<const WordVector> words_of(KeyframeId keyframe) const;

  // Returns all keyframes that share a word with `words`, ordered by id. The cost is one addition per pair of a query
  // word and a keyframe that contains it, plus a pass over the ids up to the largest.
  std::vector<CommonWords> query(const WordVector& words) const;

  std::size_t memory_bytes() const;

 private:
  std::map<KeyframeId, std::shared_ptr<const WordVector>> keyframes_;
  std::vector<std::vector<KeyframeId>> by_word_;  // each list is sorted
};

}  // namespace bslam::place
