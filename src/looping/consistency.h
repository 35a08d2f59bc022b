// Temporal consistency of place recognition: a single keyframe may resemble another place by chance, several
// consecutive ones rarely do.
#pragma once

#include <vector>

#include "looping/place_recogniser.h"

namespace bslam::looping {

// The places recognised by recent keyframes. A value type.
struct RecognitionHistory {
  struct Place {
    std::vector<KeyframeId> keyframes;  // the candidate and its covisible keyframes, in order of id
    int times = 0;                      // number of consecutive keyframes that recognised it
    KeyframeId last;                    // the last of these keyframes
  };
  std::vector<Place> places;
};

// Returns the candidates of `keyframe` whose place was recognised by enough consecutive keyframes, this one included.
// Records all candidates in `history`.
std::vector<PlaceCandidate> consistent_candidates(const map::BundledMap& map, KeyframeId keyframe,
                                                  const std::vector<PlaceCandidate>& candidates,
                                                  const LoopOptions& options, RecognitionHistory& history);

}  // namespace bslam::looping
