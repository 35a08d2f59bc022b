// The status of every camera in every frame: the one place where it is decided from what is known about the camera.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "image/image_bundle.h"

namespace bslam::tracking {

enum class CameraState : std::uint8_t {
  kOk,
  kDegraded,  // used, but it contributes less than it should
  kOut,       // not used in this frame
};

enum class CameraReason : std::uint8_t {
  kNone,
  kNoImages,  // no image in this frame, although one is due
  kBlack,     // told from the picture, as the next two
  kOverExposed,
  kFrozen,
  kBlurred,       // out of focus or smeared
  kInconsistent,  // what it sees contradicts the other cameras
  kFewFeatures,
};

// As in the summary: "ok", "degraded", "out"; "", "no-images", "black", ...
std::string_view describe(CameraState state);
std::string_view describe(CameraReason reason);

struct CameraStatus {
  CameraState state = CameraState::kOk;
  CameraReason reason = CameraReason::kNone;
  friend bool operator==(const CameraStatus&, const CameraStatus&) = default;
};

// What is known about one camera after a frame.
struct CameraEvidence {
  image::ImageState image = image::ImageState::kMissing;
  CameraReason outage = CameraReason::kNone;  // of its picture (tracking/camera_health.h); not kNone: it was not used
  bool blurred = false;
  bool inconsistent = false;  // left out by tracking (tracking/camera_consensus.h)
  bool postponed = false;     // not used: it fires after camera 0, and the motion until then is not known
  int keypoints = 0, inliers = 0;
};

// Decides the status of each camera of a rig, frame by frame. A camera that delivers images at a lower rate than frames
// come is not `no-images` between two of them: its period is the median of its last steps from image to image. A camera
// that sees plenty while hardly any of it agrees with the pose, over the frames in which other cameras do agree, is
// degraded, reason inconsistent: its extrinsics are probably wrong.
class CameraStatusMonitor {
 public:
  explicit CameraStatusMonitor(std::size_t cameras) : cameras_(cameras) {}

  // Status of each camera in the next frame. `evidence`: one entry per camera.
  std::vector<CameraStatus> update(std::span<const CameraEvidence> evidence);

 private:
  struct Camera {
    bool any_image = false;
    int since_image = 0;                // frames since its last image
    std::array<int, 9> steps = {};      // frames from one image to the next: the last ones, in a ring
    std::size_t num_steps = 0;          // ever
    double keypoints = 0, inliers = 0;  // over the frames that count for agreement
    int frames = 0;                     // of these
  };
  static void note_image(bool present, Camera& camera);
  static bool between_images(const Camera& camera);
  bool agrees_with_nothing(std::size_t camera) const;
  CameraStatus status(const CameraEvidence& evidence, std::size_t camera) const;

  std::vector<Camera> cameras_;
};

}  // namespace bslam::tracking
