#include "frame/bundled_frame.h"

#include <cmath>
#include <utility>

namespace bslam::frame {

std::size_t BundledFrame::num_keypoints() const {
  std::size_t n = 0;
  for (const CameraFrame& c : cameras) n += c.keypoints.size();
  return n;
}

double BundledFrame::delay_s(std::size_t c) const {
  const CameraFrame& camera = cameras[c];
  return camera.state == image::ImageState::kPresent ? to_seconds(camera.time_ns - time_ns) : 0.0;
}

void CameraFrame::correct_time(double shift_s) { set_correction(correction_ns + from_seconds(shift_s)); }

void CameraFrame::set_correction(TimeNs correction) {
  time_ns += correction - correction_ns;
  correction_ns = correction;
}

BundledFrame without_images(const BundledFrame& frame) {
  BundledFrame out;
  out.id = frame.id;
  out.time_ns = frame.time_ns;
  out.cameras.resize(frame.cameras.size());
  for (CameraFrame& camera : out.cameras) camera.time_ns = frame.time_ns;
  return out;
}

CameraFrame refined(CameraFrame camera_frame, feature::Refinement&& refinement, const camera::Camera& camera) {
  camera_frame.keypoints = camera_frame.keypoints.refined(std::move(refinement));
  camera_frame.grid = FeatureGrid(camera_frame.keypoints, camera.width, camera.height);
  return camera_frame;
}

bool changes_frames(const camera::Rig& before, const camera::Rig& rig) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (before.camera(c).time_offset_ns != rig.camera(c).time_offset_ns) return true;
  }
  return !rig.same_intrinsics(before);
}

BundledFrame recalibrated(BundledFrame frame, const camera::Rig& before, const camera::Rig& rig) {
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    frame.cameras[c].time_ns += rig.camera(c).time_offset_ns - before.camera(c).time_offset_ns;
    feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    feature::Refinement positions = keypoints.positions();
    for (std::size_t k = 0; k < keypoints.size(); ++k) {
      if (const auto bearing = rig.camera(c).unproject(positions.pixel[k].cast<double>()))
        positions.bearing[k] = *bearing;
    }
    keypoints = keypoints.refined(std::move(positions));
  }
  return frame;
}

bool depends_on_motion(const camera::Rig& rig, const BundledFrame& frame) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (frame.delay_s(c) != 0 || rig.camera(c).readout_s != 0) return true;
  }
  return false;
}

std::vector<double> delays_of(const BundledFrame& frame) {
  std::vector<double> delays(frame.cameras.size());
  for (std::size_t c = 0; c < delays.size(); ++c) delays[c] = frame.delay_s(c);
  return delays;
}

double farthest_delay_s(const BundledFrame& frame) {
  double farthest = 0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (const double delay = frame.delay_s(c); std::abs(delay) > std::abs(farthest)) farthest = delay;
  }
  return farthest;
}

camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame) { return rig_of(rig, frame, frame.twist); }

camera::Rig rig_of(const camera::Rig& rig, const BundledFrame& frame, const geometry::Vector6d& twist) {
  const std::vector<double> delays = delays_of(frame);
  return rig.moves().empty() ? rig.moving(delays, twist) : rig.at(frame.time_ns).moving(delays, twist);
}

}  // namespace bslam::frame
