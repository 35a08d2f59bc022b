// Selection of the landmarks that direct tracking aligns in the images of a frame.
#pragma once

#include <memory>

#include "map/search_points.h"
#include "tracking/track.h"

namespace bslam::tracking {

// The landmarks near the rig in one version of the map. It is used for several frames.
struct LocalView {
  MapVersion version;
  KeyframeId reference;
  std::vector<LandmarkId> landmarks;          // in the order of map::local_landmarks
  std::vector<matching::SearchPoint> points;  // one for each of them
};

// The landmarks of the last frame.
struct LastLandmarks {
  std::vector<LandmarkId> landmarks;          // in order of id
  std::vector<matching::SearchPoint> points;  // one for each of them
};
LastLandmarks landmarks_of_last_frame(const TrackInput& input);

// A landmark that is predicted visible in a camera.
struct Candidate {
  LandmarkId landmark;
  Eigen::Vector2d pixel;    // predicted
  double coarseness = 0;    // size of its reference patch in the image, relative to that of a patch of level 0
  std::uint32_t index = 0;  // index among all examined landmarks
};
using Candidates = std::vector<std::vector<Candidate>>;  // per camera

// Selects landmarks of the last frame for the first, coarse alignment: in every camera those with the largest patches
// in their parts of the image, because their alignment tolerates the largest errors of the predicted pose. A camera
// gets the same fraction of `coarse_per_image` as of `per_image` afterwards. The landmarks are spread over the image,
// because the largest patches may all belong to one near object, which may move.
Candidates coarsest_landmarks(const TrackInput& input, const frame::BundledFrame& frame,
                              const geometry::SE3& T_rig_world, const LastLandmarks& last, const DirectOptions& options,
                              ThreadPool& pool);

// The landmarks to align at the pose: those of the last frame and of the local view, spread over the images.
// Overlapping cameras align the same landmarks. The number per image depends on the cameras in use, not on those that
// have an image in this frame.
struct LocalLandmarks {
  std::shared_ptr<const LocalView> view;
  Candidates candidates;
  std::vector<LandmarkId> expected;  // landmarks of the candidates, in order of id, each once
  // Landmarks of the last frame that are in view but no candidates because there are enough others, in order of id.
  std::vector<LandmarkId> others;
};

LocalLandmarks local_landmarks(const TrackInput& input, const frame::BundledFrame& frame,
                               const geometry::SE3& T_rig_world, const LastLandmarks& last,
                               const TrackingOptions& options, ThreadPool& pool);

}  // namespace bslam::tracking
