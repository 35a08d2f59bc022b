// The paper's BundledFrame: what N cameras saw together. No pose, no images; immutable once it leaves tracking, shared.
#pragma once

#include <vector>

#include "base/id.h"
#include "base/timestamp.h"
#include "feature/keypoints.h"
#include "frame/bundled.h"
#include "frame/feature_grid.h"
#include "image/image_bundle.h"

namespace bslam::frame {

// One camera's part of a frame.
struct CameraFrame {
  image::ImageState state = image::ImageState::kMissing;
  TimeNs time_ns = 0;             // its own capture time
  feature::Keypoints keypoints;   // empty where the image is missing or damaged
  FeatureGrid grid;
  std::vector<WordId> words;      // per keypoint, of the vocabulary of the run; empty until somebody asks for them
};

struct BundledFrame {
  FrameId id;
  TimeNs time_ns = 0;
  std::vector<CameraFrame> cameras;  // one per camera of the rig
  Bundled bundled;

  const feature::Keypoints& keypoints(CameraIndex c) const { return cameras[c.index()].keypoints; }
  std::size_t num_keypoints() const;
};

}  // namespace bslam::frame
