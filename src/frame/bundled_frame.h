// The paper's BundledFrame: the keypoints of N cameras at one time, without pose and images. A value whose large arrays
// are immutable and shared by its copies.
#pragma once

#include <optional>
#include <vector>

#include "base/id.h"
#include "base/timestamp.h"
#include "camera/rig.h"
#include "feature/keypoints.h"
#include "frame/bundled.h"
#include "frame/feature_grid.h"
#include "image/image_bundle.h"

namespace bslam::frame {

// The data of one camera of a frame.
struct CameraFrame {
  image::ImageState state = image::ImageState::kMissing;
  TimeNs time_ns = 0;  // its own capture time
  // The part of it that the images show, and not the stamp; and the variance of the errors of the camera's stamps,
  // which is 0 if they are taken as exact (tracking/stamp_errors.h).
  TimeNs correction_ns = 0;
  double stamp_variance_s2 = 0;
  feature::Keypoints keypoints;  // empty if the image is missing or damaged
  FeatureGrid grid;              // grid of the keypoints' pixels
  SharedArray<WordId> words;     // per keypoint, word of the vocabulary; empty until computed

  // The image was captured so much later than its present capture time, or than its stamp says.
  void correct_time(double shift_s);
  void set_correction(TimeNs correction);
};

// What the matched features of a frame say about the size of a map whose scale is not known.
struct StereoScale {
  double factor = 1;    // by which the map is too small
  int gauge_epoch = 0;  // of the map, which has another size in other epochs
};

struct BundledFrame {
  FrameId id;
  TimeNs time_ns = 0;
  std::vector<CameraFrame> cameras;  // one per camera of the rig
  Bundled bundled;
  // Velocity of the rig during the capture, rad/s and m/s (see camera::Rig::moving), estimated by tracking; zero if
  // unknown. For keyframes BundledKeyframe::twist is used instead.
  geometry::Vector6d twist = geometry::Vector6d::Zero();
  // The twist is not known: images that were captured at different times must not be compared.
  bool motion_unknown = false;
  std::optional<StereoScale> stereo_scale =
      {};  // of a keyframe, found by tracking for mapping (tracking/stereo_scale.h)

  const feature::Keypoints& keypoints(CameraIndex c) const { return cameras[c.index()].keypoints; }
  std::size_t num_keypoints() const;
  // Capture time of camera c's image minus the time of the frame, in seconds; 0 if it has no image.
  double delay_s(std::size_t c) const;
};

// The frame as if no camera had delivered an image.
BundledFrame without_images(const BundledFrame& frame);

// A camera's data with its keypoints at refined positions, and their grid.
CameraFrame refined(CameraFrame camera_frame, feature::Refinement&& refinement, const camera::Camera& camera);

// The frame after a change of the calibration `before` to `rig`: with the bearings of its keypoints and the capture
// times of its images. Keypoints that their camera does not unproject keep their bearing.
BundledFrame recalibrated(BundledFrame frame, const camera::Rig& before, const camera::Rig& rig);
// Returns true if this change of the calibration changes frames.
bool changes_frames(const camera::Rig& before, const camera::Rig& rig);

// Whether projections into the frame depend on the motion of the rig: some image was captured at another time than the
// frame's, or has a rolling shutter.
bool depends_on_motion(const camera::Rig& rig, const BundledFrame& frame);

// BundledFrame::delay_s per camera.
std::vector<double> delays_of(const BundledFrame& frame);
// The delay with the largest absolute value.
double farthest_delay_s(const BundledFrame& frame);

// The rig at the time of the frame, with the camera poses at their capture times, for the frame's twist or the given
// one.
camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame);
camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame, const geometry::Vector6d& twist);

}  // namespace bslam::frame
