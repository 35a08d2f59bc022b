// The paper's BundledFrame: what N cameras saw together. No pose, no images. A value whose large arrays are shared by
// its copies and never changed: each stage takes a frame and makes another one.
#pragma once

#include <vector>

#include "base/id.h"
#include "base/timestamp.h"
#include "camera/rig.h"
#include "feature/keypoints.h"
#include "frame/bundled.h"
#include "frame/feature_grid.h"
#include "image/image_bundle.h"

namespace bslam::frame {

// One camera's part of a frame.
struct CameraFrame {
  image::ImageState state = image::ImageState::kMissing;
  TimeNs time_ns = 0;            // its own capture time
  feature::Keypoints keypoints;  // empty where the image is missing or damaged
  FeatureGrid grid;              // of the keypoints' pixels
  std::vector<WordId> words;     // per keypoint, of the vocabulary of the run; empty until somebody asks for them
};

struct BundledFrame {
  FrameId id;
  TimeNs time_ns = 0;
  std::vector<CameraFrame> cameras;  // one per camera of the rig
  Bundled bundled;
  // Velocity of the rig while its cameras fired, rad/s and m/s (see camera::Rig::moving), as tracking estimates it;
  // zero where nothing is known. The map holds that of a keyframe.
  geometry::Vector6d twist = geometry::Vector6d::Zero();

  const feature::Keypoints& keypoints(CameraIndex c) const { return cameras[c.index()].keypoints; }
  std::size_t num_keypoints() const;
  // Time of camera c's image after that of the frame, in seconds; 0 where it has none.
  double delay_s(std::size_t c) const;
};

// A camera's part with its keypoints at other positions, and the grid of these.
CameraFrame refined(CameraFrame part, feature::Refinement&& refinement, const camera::Camera& camera);

// Per camera.
std::vector<double> delays_of(const BundledFrame& frame);
// Of the camera that fires farthest from the time of the frame, before or after it.
double farthest_delay_s(const BundledFrame& frame);

// The rig as it stood while the frame was taken, moving by the frame's twist or another one.
camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame);
camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame, const geometry::Vector6d& twist);

}  // namespace bslam::frame
