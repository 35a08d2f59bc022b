// Inverted index: for each word, the keyframes that contain it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/id.h"
#include "place/word_vector.h"

namespace bslam::place {

struct CommonWords {
  KeyframeId keyframe;
  int count = 0;     // number of words shared with the query, 1 or more
  double score = 0;  // l1_score of the query and the keyframe
  friend bool operator==(const CommonWords&, const CommonWords&) = default;
};

// The content, and therefore every result, depends on which keyframes were added, not on the order of adding.
class InvertedIndex {
 public:
  // The keyframe must not be in the index yet; `words` must not be null.
  void add(KeyframeId keyframe, std::shared_ptr<const WordVector> words);
  // The same for several keyframes, in order of id: the lists of the words are allocated once.
  struct Entry {
    KeyframeId keyframe;
    std::shared_ptr<const WordVector> words;
  };
  void add(std::span<const Entry> entries);
  void remove(KeyframeId keyframe);  // does nothing if the keyframe is not in the index

  bool contains(KeyframeId keyframe) const {
    return keyframe.valid() && keyframe.index() < words_.size() && words_[keyframe.index()] != nullptr;
  }
  std::size_t size() const { return size_; }

  // Returns null if the keyframe is not in the index.
  std::shared_ptr<const WordVector> words_of(KeyframeId keyframe) const;

  // Returns all keyframes that share a word with `words`, ordered by id. The cost is two additions per pair of a query
  // word and a keyframe that contains it, plus a pass over the ids up to the largest.
  std::vector<CommonWords> query(const WordVector& words) const;

  std::size_t memory_bytes() const;

 private:
  std::vector<std::shared_ptr<const WordVector>> words_;  // by id, null for keyframes that are not in the index
  std::size_t size_ = 0;
  struct Posting {
    KeyframeId keyframe;
    float weight;  // weight of the word in the keyframe
  };
  std::vector<std::vector<Posting>> by_word_;  // each list is in order of id
};

}  // namespace bslam::place
