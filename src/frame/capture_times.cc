#include "frame/capture_times.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace bslam::frame {

bool can_be_compared(const BundledFrame& frame, CameraIndex a, CameraIndex b) {
  const TimeNs apart = frame.cameras[a.index()].time_ns - frame.cameras[b.index()].time_ns;
  return !frame.motion_unknown || std::abs(apart) <= kTogetherNs;
}

bool captured_apart(const BundledFrame& frame, CameraIndex a, CameraIndex b) {
  return !frame.cameras[a.index()].keypoints.empty() && !frame.cameras[b.index()].keypoints.empty() &&
         !can_be_compared(frame, a, b);
}

std::size_t reference_camera(const BundledFrame& frame) {
  const auto apart_ns = [&](const CameraFrame& camera) {
    const bool present = camera.state == image::ImageState::kPresent;
    return present ? std::abs(camera.time_ns - camera.correction_ns - frame.time_ns)
                   : std::numeric_limits<TimeNs>::max();
  };
  const auto nearest = std::ranges::min_element(frame.cameras, {}, apart_ns);
  return static_cast<std::size_t>(nearest - frame.cameras.begin());
}

double capture_span_s(const BundledFrame& frame) {
  const std::vector<double> delays = delays_of(frame);
  const auto [first, last] = std::ranges::minmax(delays);
  return last - first;
}

std::vector<std::uint8_t> without_late_cameras(const camera::Rig& rig, const image::ImageBundle& images,
                                               std::span<const std::uint8_t> skipped) {
  std::vector<std::uint8_t> out(skipped.begin(), skipped.end());
  std::vector<std::uint8_t> absent = out;
  for (std::size_t c = 0; c < out.size(); ++c) {
    const image::CameraImage& image = images.images[c];
    const bool present = image.state == image::ImageState::kPresent;
    absent[c] |= !present;
    out[c] |= present && std::abs(image.time_ns - images.time_ns) > kTogetherNs;
  }
  std::vector<std::uint8_t> gone = absent;
  for (std::size_t c = 0; c < out.size(); ++c) gone[c] |= out[c];
  const bool some = std::ranges::find(gone, std::uint8_t{0}) != gone.end();
  if (!some || (rig.any_overlap(absent) && !rig.any_overlap(gone))) return {skipped.begin(), skipped.end()};
  return out;
}

}  // namespace bslam::frame
