#include "core/diagnostics.h"

#include <cstdio>
#include <utility>

namespace bslam_ros {
namespace {

constexpr double kSilent_s = 2;

std::string decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

void set_level(const Report& report, DiagnosticStatus& out) {
  if (!report.failure.empty()) {
    out.level = Level::kError;
    out.message = report.failure;
  } else if (report.seconds_silent > kSilent_s) {
    out.level = Level::kStale;
    out.message = "no frame for " + decimal(report.seconds_silent) + " s";
  } else if (!report.last) {
    out.level = Level::kWarn;
    out.message = "waiting for images";
  } else if (report.last->status == bslam::TrackingStatus::kLost) {
    out.level = Level::kError;
    out.message = "lost: " + std::string(to_string(report.last->reason));
  } else if (!report.last->tracking()) {
    out.level = Level::kWarn;
    out.message = "no map yet: the images need texture and, without overlapping cameras, the rig must move";
  } else if (report.last->scale != bslam::Scale::kMetric) {
    out.level = Level::kWarn;
    out.message = "tracking, but lengths are not metres: the scale is " + std::string(to_string(report.last->scale));
  } else {
    out.message = report.localize_only ? "localising" : "tracking";
  }
}

DiagnosticStatus tracking_status(const Report& report) {
  DiagnosticStatus out;
  out.name = "bslam: tracking";
  set_level(report, out);
  const auto add = [&](const char* key, std::string value) { out.values.emplace_back(key, std::move(value)); };
  if (report.last) {
    int inliers = 0;
    for (const bslam::CameraResult& camera : report.last->cameras) inliers += camera.inliers;
    add("status", std::string(to_string(report.last->status)));
    add("reason", std::string(to_string(report.last->reason)));
    add("scale", std::string(to_string(report.last->scale)));
    add("submap", std::to_string(report.last->submap));
    add("inliers", std::to_string(inliers));
    add("frame_ms", decimal(report.last->total_ms));
  }
  add("localize_only", report.localize_only ? "true" : "false");
  add("frames", std::to_string(report.frames));
  add("frames_lost", std::to_string(report.lost));
  add("loops", std::to_string(report.loops));
  add("keyframes", std::to_string(report.keyframes));
  add("landmarks", std::to_string(report.landmarks));
  return out;
}

DiagnosticStatus camera_status(const Report& report, std::size_t c) {
  const CameraReport& camera = report.cameras[c];
  DiagnosticStatus out;
  out.name = "bslam: camera " + camera.name;
  out.message = "waiting for images";
  out.level = Level::kWarn;
  const auto add = [&](std::string key, std::string value) {
    out.values.emplace_back(std::move(key), std::move(value));
  };
  if (report.last && c < report.last->cameras.size()) {
    const bslam::CameraResult& result = report.last->cameras[c];
    const bool ok = result.state == bslam::CameraState::kOk;
    out.level = ok ? Level::kOk : result.state == bslam::CameraState::kDegraded ? Level::kWarn : Level::kError;
    out.message = std::string(to_string(result.state)) + (ok ? "" : ": " + std::string(result.reason));
    add("keypoints", std::to_string(result.keypoints));
    add("matched", std::to_string(result.matched));
    add("inliers", std::to_string(result.inliers));
  }
  add("images", std::to_string(camera.received));
  for (std::size_t r = 0; r < bslam::kDropReasons; ++r)
    add("dropped (" + std::string(to_string(static_cast<bslam::DropReason>(r))) + ")",
        std::to_string(camera.dropped[r]));
  add("rejected", std::to_string(camera.rejected));
  if (camera.rejected > 0) add("last rejection", camera.last_error);
  if (camera.received == 0 && camera.rejected > 0) {
    out.level = Level::kError;
    out.message = camera.last_error;
  } else if (report.seconds_silent > kSilent_s) {
    out.level = Level::kStale;
  }
  return out;
}

}  // namespace

std::vector<DiagnosticStatus> to_diagnostics(const Report& report) {
  std::vector<DiagnosticStatus> out = {tracking_status(report)};
  for (std::size_t c = 0; c < report.cameras.size(); ++c) out.push_back(camera_status(report, c));
  return out;
}

}  // namespace bslam_ros
