// One keyframe may look like another place by chance; several in a row hardly do.
#pragma once

#include <vector>

#include "looping/place_recogniser.h"

namespace bslam::looping {

// Places recognised by the last keyframes; a value.
struct RecognitionHistory {
  struct Place {
    std::vector<KeyframeId> keyframes;  // the candidate and what is covisible with it, in order of id
    int times = 0;                      // keyframes in a row that recognised it
    KeyframeId last;                    // of them
  };
  std::vector<Place> places;
};

// The candidates of `keyframe` whose place the keyframes before it recognised as well, often enough; notes them all.
std::vector<Candidate> consistent_candidates(const map::BundledMap& map, KeyframeId keyframe, const std::vector<Candidate>& candidates,
                                             const LoopOptions& options, RecognitionHistory& history);

}  // namespace bslam::looping
