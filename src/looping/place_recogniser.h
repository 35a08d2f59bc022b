// Place recognition by appearance: finds keyframes that may show the same place as a frame. Geometric verification
// follows in looping/verify_place.h.
#pragma once

#include <memory>
#include <vector>

#include "frame/bundled_frame.h"
#include "looping/options.h"
#include "map/bundled_map.h"
#include "place/inverted_index.h"
#include "place/vocabulary.h"

namespace bslam::looping {

struct PlaceCandidate {
  KeyframeId keyframe;
  double score = 0;  // score of its group; candidates are sorted by decreasing score
};

// Returns the neighbours of a keyframe, that is the keyframes that share enough landmarks with it, in order of id.
std::vector<map::Covisible> neighbours_of(const map::BundledMap& map, KeyframeId keyframe,
                                          const RecognitionOptions& options);

// Interface that allows other detectors. Results depend on the arguments only, never on earlier calls.
class PlaceRecogniser {
 public:
  virtual ~PlaceRecogniser() = default;

  // Computes what is needed to query a frame or to add it as a keyframe. Does nothing if that was done already.
  virtual void describe(frame::BundledFrame& frame) const = 0;

  // Returns keyframes of `map` that may show the place of `keyframe`, excluding its neighbours.
  virtual std::vector<PlaceCandidate> query_keyframe(const map::BundledMap& map, KeyframeId keyframe) = 0;

  // Returns keyframes of `map` that may show the place of a frame prepared by describe().
  virtual std::vector<PlaceCandidate> query_frame(const map::BundledMap& map, const frame::BundledFrame& frame) = 0;

  // Memory of its index, in bytes.
  virtual std::size_t memory_bytes() const { return 0; }
};

// Bag of words: each unique feature of every camera contributes its word.
class BagOfWordsRecogniser : public PlaceRecogniser {
 public:
  BagOfWordsRecogniser(place::VocabularyPtr vocabulary, const RecognitionOptions& options);

  void describe(frame::BundledFrame& frame) const override;
  std::vector<PlaceCandidate> query_keyframe(const map::BundledMap& map, KeyframeId keyframe) override;
  std::vector<PlaceCandidate> query_frame(const map::BundledMap& map, const frame::BundledFrame& frame) override;
  std::size_t memory_bytes() const override;

 private:
  using Words = std::shared_ptr<const place::WordVector>;
  void sync(const map::BundledMap& map);
  Words words_of(const frame::BundledFrame& frame) const;
  struct Bounds {
    double min_common_word_ratio, min_group_score_ratio;  // as in RecognitionOptions
    double min_score = 0;                                 // minimum score of a single keyframe
  };
  std::vector<PlaceCandidate> rank(const map::BundledMap& map, const place::WordVector& words,
                                   const std::vector<std::uint8_t>& excluded, const Bounds& bounds) const;

  const place::VocabularyPtr vocabulary_;
  const RecognitionOptions options_;
  place::InvertedIndex index_;
  // frame of each keyframe in the index, by keyframe id; not owned, so that frames of removed keyframes are released
  std::vector<std::weak_ptr<const frame::BundledFrame>> known_;
};

}  // namespace bslam::looping
