// Relocalisation: estimates the pose of a frame without a pose prior in any submap, using all cameras.
#pragma once

#include <optional>

#include "looping/locate.h"
#include "looping/place_recogniser.h"

namespace bslam::looping {

// The frame must be prepared by PlaceRecogniser::describe. Returns nullopt if no place is verified, or if two verified
// places contradict each other, since look-alike rooms cannot be distinguished from a single frame.
std::optional<Location> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map,
                                   const frame::BundledFrame& frame, const VerificationOptions& options,
                                   const map::FeatureModel& features, Random random);

}  // namespace bslam::looping
