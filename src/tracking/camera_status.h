// The status of every camera in every frame, determined from its images and from tracking.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "image/image_bundle.h"

namespace bslam::tracking {

enum class CameraState : std::uint8_t {
  kOk,
  kDegraded,  // used, but contributes less than expected
  kOut,       // not used in this frame
};

enum class CameraReason : std::uint8_t {
  kNone,
  kNoImages,  // no image in this frame, although one is due
  kBlack,     // this and the next two are determined from the image
  kOverExposed,
  kFrozen,
  kBlurred,       // out of focus or smeared
  kInconsistent,  // its images contradict the other cameras
  kFewFeatures,
};

// Names used in the summary: "ok", "degraded", "out"; "", "no-images", "black", ...
std::string_view describe(CameraState state);
std::string_view describe(CameraReason reason);

struct CameraStatus {
  CameraState state = CameraState::kOk;
  CameraReason reason = CameraReason::kNone;
  friend bool operator==(const CameraStatus&, const CameraStatus&) = default;
};

// Observations about one camera in one frame.
struct CameraEvidence {
  image::ImageState image = image::ImageState::kMissing;
  CameraReason outage = CameraReason::kNone;  // fault of its image (tracking/camera_health.h); kNone: it was used
  bool blurred = false;
  bool inconsistent = false;  // excluded by tracking (tracking/camera_consensus.h)
  bool postponed = false;     // not used: it captures after camera 0, and the motion until then is not known
  // Number of keypoints extracted from its last image, if known; nullopt: no keypoints were extracted.
  std::optional<int> extracted;
  int keypoints = 0, inliers = 0;
};

// Determines the status of each camera of a rig, frame by frame. A camera whose image rate is lower than the frame rate
// is not `no-images` between two images: its period is the median of the last intervals between its images. A camera is
// degraded with the reason `inconsistent` if it has many keypoints of which hardly any agrees with the pose, counted
// over the last hundreds of frames in which some camera agrees: its extrinsics are probably wrong.
class CameraStatusMonitor {
 public:
  explicit CameraStatusMonitor(std::size_t cameras) : cameras_(cameras) {}

  // Status of each camera in the next frame. `evidence`: one entry per camera.
  std::vector<CameraStatus> update(std::span<const CameraEvidence> evidence);

 private:
  struct Camera {
    bool any_image = false;
    int since_image = 0;                // frames since its last image
    std::array<int, 9> steps = {};      // ring buffer of the last intervals between images, in frames
    std::size_t num_steps = 0;          // total number of intervals so far
    double keypoints = 0, inliers = 0;  // sums over the frames in which some camera has inliers, of decreasing weight
    int frames = 0;                     // number of these frames
    bool few_features = false;          // in the last image whose features were extracted
  };
  static void record_image(bool present, Camera& camera);
  static bool between_images(const Camera& camera);
  bool is_inconsistent(std::size_t camera) const;
  CameraStatus status(const CameraEvidence& evidence, std::size_t camera) const;

  std::vector<Camera> cameras_;
};

}  // namespace bslam::tracking
