// Where in the map might this frame have been taken? Appearance alone; geometry decides afterwards (looping/locate.h).
#pragma once

#include <memory>
#include <vector>

#include "frame/bundled_frame.h"
#include "looping/options.h"
#include "map/bundled_map.h"
#include "place/inverted_index.h"
#include "place/vocabulary.h"

namespace bslam::looping {

struct Candidate {
  KeyframeId keyframe;
  double score = 0;  // of its group, falling
};

// The neighbours of a keyframe, those that share much with it and whose place it therefore knows, in order of id.
std::vector<map::Covisible> neighbours_of(const map::BundledMap& map, KeyframeId keyframe, const RecognitionOptions& options);

// An interface, so that another detector can stand in. Answers depend on the arguments alone, never on earlier calls.
class PlaceRecogniser {
 public:
  virtual ~PlaceRecogniser() = default;

  // Prepares a frame to be asked about or to become a keyframe; nothing where that was done already.
  virtual void describe(frame::BundledFrame& frame) const = 0;

  // Keyframes of `map` that may show the place of `keyframe`, but for its neighbours: those that share much with it.
  virtual std::vector<Candidate> revisited(const map::BundledMap& map, KeyframeId keyframe) = 0;

  // Keyframes of `map` that may show the place of a described frame.
  virtual std::vector<Candidate> recognised(const map::BundledMap& map, const frame::BundledFrame& frame) = 0;
};

// Bag of words: every unique feature of every camera votes with its word.
class BagOfWordsRecogniser : public PlaceRecogniser {
 public:
  BagOfWordsRecogniser(place::VocabularyPtr vocabulary, const RecognitionOptions& options);

  void describe(frame::BundledFrame& frame) const override;
  std::vector<Candidate> revisited(const map::BundledMap& map, KeyframeId keyframe) override;
  std::vector<Candidate> recognised(const map::BundledMap& map, const frame::BundledFrame& frame) override;

 private:
  using Words = std::shared_ptr<const place::WordVector>;
  void sync(const map::BundledMap& map);
  Words words_of(const frame::BundledFrame& frame) const;
  struct Bounds {
    double min_common_word_ratio, min_group_score_ratio;  // as in RecognitionOptions
    double min_score = 0;              // of one keyframe
  };
  std::vector<Candidate> rank(const map::BundledMap& map, const place::WordVector& words, const std::vector<std::uint8_t>& excluded,
                              const Bounds& bounds) const;

  const place::VocabularyPtr vocabulary_;
  const RecognitionOptions options_;
  place::InvertedIndex index_;
  std::vector<std::shared_ptr<const frame::BundledFrame>> known_;  // per keyframe slot of the index; null = none
};

}  // namespace bslam::looping
