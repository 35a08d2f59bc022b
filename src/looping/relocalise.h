// Relocalisation: the pose of a frame nothing is known of, in any part of the map, from any of its cameras.
#pragma once

#include <optional>

#include "looping/locate.h"
#include "looping/place_recogniser.h"

namespace bslam::looping {

// The frame is described (PlaceRecogniser::describe). Empty where no place is confirmed, and where two are that
// contradict each other: rooms that look alike cannot be told apart from one frame.
std::optional<Location> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map,
                                   const frame::BundledFrame& frame, const VerificationOptions& options,
                                   const feature::FeatureModel& features, Random random);

}  // namespace bslam::looping
