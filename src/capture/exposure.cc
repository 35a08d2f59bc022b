#include "capture/exposure.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "capture/video_modes.h"

namespace bslam::capture {
namespace {

constexpr int kUnitUs = 100;  // unit of V4L2_CID_EXPOSURE_ABSOLUTE in microseconds

bool set_control(VideoCalls& calls, int device, std::uint32_t id, int value) {
  v4l2_control control{id, value};
  return video_ioctl(calls, device, VIDIOC_S_CTRL, &control) >= 0;
}

}  // namespace

Status set_exposure(VideoCalls& calls, int device, const std::string& path, const StreamRequest& request) {
  using Exposure = StreamRequest::Exposure;
  if (request.exposure == Exposure::kAsItIs) return {};
  if (request.exposure == Exposure::kAutomatic) {
    // USB cameras have a fixed aperture, and call it aperture priority if they choose the time alone.
    if (set_control(calls, device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY) ||
        set_control(calls, device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO))
      return {};
    return Error{path, "--exposure", "a camera without automatic exposure", "no --exposure auto"};
  }
  v4l2_queryctrl range{};
  range.id = V4L2_CID_EXPOSURE_ABSOLUTE;
  if (video_ioctl(calls, device, VIDIOC_QUERYCTRL, &range) < 0 || (range.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
    return Error{path, "--exposure", "a camera whose exposure cannot be set", "no --exposure"};
  const int value = static_cast<int>(std::lround(static_cast<double>(request.exposure_us) / kUnitUs));
  if (value < range.minimum || value > range.maximum) {
    return Error{
        path, "--exposure", fmt::format("{} us", request.exposure_us),
        fmt::format("{} to {} us", std::int64_t{range.minimum} * kUnitUs, std::int64_t{range.maximum} * kUnitUs)};
  }
  set_control(calls, device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);  // not all cameras have it
  if (!set_control(calls, device, V4L2_CID_EXPOSURE_ABSOLUTE, value))
    return Error{path, "--exposure", std::strerror(errno), "an exposure that can be set"};
  return {};
}

}  // namespace bslam::capture
