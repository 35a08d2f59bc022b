// Relocalisation: estimates the pose of a frame without a pose prior in any submap, using all cameras.
#pragma once

#include <functional>
#include <optional>

#include "looping/place_recogniser.h"
#include "looping/verify_place.h"

namespace bslam::looping {

// The frame must be prepared by PlaceRecogniser::describe. Returns nullopt if no plausible place is verified, or if two
// of them contradict each other, since look-alike rooms cannot be distinguished from a single frame.
std::optional<PlaceMatch> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map,
                                     const frame::BundledFrame& frame,
                                     const std::function<bool(const PlaceMatch&)>& plausible,
                                     const VerificationOptions& options, const feature::FeatureModel& features,
                                     Random random);

}  // namespace bslam::looping
