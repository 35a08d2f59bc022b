#include "tracking/camera_status.h"

#include <algorithm>

#include "base/assert.h"
#include "base/median.h"

namespace bslam::tracking {
namespace {

constexpr int kFewKeypoints = 30;   // in an image; a camera with fewer hardly contributes
constexpr int kUnknownPeriod = 11;  // frames without an image until a camera of unknown period is out

// Ratios of inliers to keypoints of a camera, and the minimum number of keypoints and frames to evaluate them.
constexpr double kHealthyInlierRatio = 0.1, kMaxInconsistentInlierRatio = 0.02;
constexpr double kMinKeypoints = 1000;
constexpr int kMinFrames = 10;
constexpr double kWindow = 300;  // number of frames after which a frame counts little, so that late faults are seen

// Returns true if the number of keypoints is meaningful for the image.
bool counts_features(const CameraEvidence& e) {
  return e.extracted && e.image == image::ImageState::kPresent && e.outage == CameraReason::kNone && !e.inconsistent &&
         !e.postponed;
}

}  // namespace

std::string_view describe(CameraState state) {
  switch (state) {
    case CameraState::kOk:
      return "ok";
    case CameraState::kDegraded:
      return "degraded";
    case CameraState::kOut:
      return "out";
  }
  return "";
}

std::string_view describe(CameraReason reason) {
  switch (reason) {
    case CameraReason::kNone:
      return "";
    case CameraReason::kNoImages:
      return "no-images";
    case CameraReason::kBlack:
      return "black";
    case CameraReason::kOverExposed:
      return "over-exposed";
    case CameraReason::kFrozen:
      return "frozen";
    case CameraReason::kBlurred:
      return "blurred";
    case CameraReason::kInconsistent:
      return "inconsistent";
    case CameraReason::kFewFeatures:
      return "few-features";
  }
  return "";
}

void CameraStatusMonitor::record_image(bool present, Camera& camera) {
  ++camera.since_image;
  if (!present) return;
  if (camera.any_image) camera.steps[camera.num_steps++ % camera.steps.size()] = camera.since_image;
  camera.any_image = true;
  camera.since_image = 0;
}

bool CameraStatusMonitor::between_images(const Camera& camera) {
  if (camera.num_steps == 0) return camera.since_image < kUnknownPeriod;
  const auto known = static_cast<std::ptrdiff_t>(std::min(camera.num_steps, camera.steps.size()));
  return camera.since_image < lower_median(std::vector<int>(camera.steps.begin(), camera.steps.begin() + known));
}

bool CameraStatusMonitor::is_inconsistent(std::size_t camera) const {
  const Camera& c = cameras_[camera];
  if (c.frames < kMinFrames || c.keypoints < kMinKeypoints || c.inliers > kMaxInconsistentInlierRatio * c.keypoints)
    return false;
  return std::ranges::any_of(cameras_, [](const Camera& other) {
    return other.keypoints >= kMinKeypoints && other.inliers > kHealthyInlierRatio * other.keypoints;
  });
}

CameraStatus CameraStatusMonitor::status(const CameraEvidence& evidence, std::size_t camera) const {
  const bool no_image = evidence.outage == CameraReason::kNoImages;
  if (no_image && evidence.image == image::ImageState::kMissing && between_images(cameras_[camera])) return {};
  const bool image_is_good = evidence.outage == CameraReason::kNone;
  if (image_is_good && evidence.blurred)  // blur also explains the inconsistency
    return {evidence.inconsistent ? CameraState::kOut : CameraState::kDegraded, CameraReason::kBlurred};
  if (!image_is_good) return {CameraState::kOut, evidence.outage};
  if (evidence.inconsistent) return {CameraState::kOut, CameraReason::kInconsistent};
  if (evidence.postponed) return {};
  if (cameras_[camera].few_features) return {CameraState::kDegraded, CameraReason::kFewFeatures};
  if (is_inconsistent(camera)) return {CameraState::kDegraded, CameraReason::kInconsistent};
  return {};
}

std::vector<CameraStatus> CameraStatusMonitor::update(std::span<const CameraEvidence> evidence) {
  BSLAM_ASSERT(evidence.size() == cameras_.size(), "there must be one entry per camera");
  const bool any_agrees = std::ranges::any_of(evidence, [](const CameraEvidence& e) { return e.inliers > 0; });
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    record_image(evidence[c].image == image::ImageState::kPresent, cameras_[c]);
    if (counts_features(evidence[c])) cameras_[c].few_features = *evidence[c].extracted < kFewKeypoints;
    if (!any_agrees || evidence[c].keypoints == 0) continue;
    constexpr double kKept = 1 - 1 / kWindow;
    cameras_[c].keypoints = kKept * cameras_[c].keypoints + evidence[c].keypoints;
    cameras_[c].inliers = kKept * cameras_[c].inliers + evidence[c].inliers;
    ++cameras_[c].frames;
  }
  std::vector<CameraStatus> out;
  for (std::size_t c = 0; c < cameras_.size(); ++c) out.push_back(status(evidence[c], c));
  return out;
}

}  // namespace bslam::tracking
