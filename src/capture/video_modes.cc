#include "capture/video_modes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "capture/pixels.h"

namespace bslam::capture {
namespace {

constexpr std::uint32_t kMostEntries = 1000;  // bound for the entries of a list, in case a driver never ends it
constexpr double kUsualFps = 60;              // a higher rate has to be asked for

double rate_of(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0 : static_cast<double>(interval.denominator) / interval.numerator;
}

void add_rates(VideoCalls& calls, int device, std::uint32_t width, std::uint32_t height, VideoMode& mode) {
  std::vector<double>& out = mode.fps;
  for (std::uint32_t k = 0; k < kMostEntries; ++k) {
    v4l2_frmivalenum interval{};
    interval.index = k;
    interval.pixel_format = mode.pixels;
    interval.width = width;
    interval.height = height;
    if (video_ioctl(calls, device, VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) break;
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      out.push_back(rate_of(interval.discrete));
      continue;
    }
    out = {rate_of(interval.stepwise.min), rate_of(interval.stepwise.max)};
    mode.any_between = true;
    break;
  }
  std::erase_if(out, [](double fps) { return !(fps > 0); });
  std::ranges::sort(out, std::greater());
}

int whole(std::uint32_t value) { return static_cast<int>(std::min<std::uint32_t>(value, 100'000)); }

void add_sizes(VideoCalls& calls, int device, FourCc pixels, std::vector<VideoMode>& out) {
  const std::size_t before = out.size();
  for (std::uint32_t k = 0; k < kMostEntries; ++k) {
    v4l2_frmsizeenum size{};
    size.index = k;
    size.pixel_format = pixels;
    if (video_ioctl(calls, device, VIDIOC_ENUM_FRAMESIZES, &size) < 0) break;
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      const int w = whole(size.discrete.width), h = whole(size.discrete.height);
      out.push_back({pixels, w, h, w, h, 1, 1});
      add_rates(calls, device, size.discrete.width, size.discrete.height, out.back());
      continue;
    }
    const v4l2_frmsize_stepwise& s = size.stepwise;
    out.push_back({pixels, whole(s.max_width), whole(s.max_height), whole(s.min_width), whole(s.min_height),
                   std::max(1, whole(s.step_width)), std::max(1, whole(s.step_height))});
    add_rates(calls, device, s.max_width, s.max_height, out.back());
    break;
  }
  if (out.size() == before) out.push_back({.pixels = pixels});
}

std::string mode_text(const VideoMode& mode) {
  if (mode.width == 0) return fourcc_text(mode.pixels);
  std::string out = fmt::format("{} {}x{}", fourcc_text(mode.pixels), mode.width, mode.height);
  if (mode.min_width != mode.width || mode.min_height != mode.height)
    out = fmt::format("{} {}x{} to {}x{}", fourcc_text(mode.pixels), mode.min_width, mode.min_height, mode.width,
                      mode.height);
  std::vector<std::string> rates;
  for (const double fps : mode.fps) rates.push_back(fmt::format("{:.4g}", fps));
  if (rates.empty()) return out;
  if (mode.any_between && rates.size() > 1)
    return fmt::format("{} ({} to {} frames/s)", out, rates.back(), rates.front());
  return fmt::format("{} ({} frames/s)", out, fmt::join(rates, ", "));
}

struct Capability {
  std::string name;
  bool captures = false;
};

// Opens a device, reads its name and, if `modes` is given, its modes, and closes it. `found` of the error is the
// message of the operating system.
Result<Capability> capability(VideoCalls& calls, const std::string& path, std::vector<VideoMode>* modes) {
  const int device = calls.open(path.c_str());
  if (device < 0) return Error{path, "", std::strerror(errno), ""};
  v4l2_capability found{};
  const bool video = video_ioctl(calls, device, VIDIOC_QUERYCAP, &found) >= 0;
  const std::uint32_t what = found.capabilities & V4L2_CAP_DEVICE_CAPS ? found.device_caps : found.capabilities;
  Capability out{std::string(reinterpret_cast<const char*>(found.card),
                             ::strnlen(reinterpret_cast<const char*>(found.card), sizeof(found.card))),
                 video && (what & V4L2_CAP_VIDEO_CAPTURE) != 0};
  if (out.captures && modes != nullptr) *modes = video_modes(calls, device);
  calls.close(device);
  return out;
}

}  // namespace

bool VideoMode::has_size(int w, int h) const {
  if (width == 0) return true;
  return w >= min_width && w <= width && h >= min_height && h <= height && (w - min_width) % step_width == 0 &&
         (h - min_height) % step_height == 0;
}

int video_ioctl(VideoCalls& calls, int device, unsigned long request, void* argument) {
  int result = 0;
  do result = calls.ioctl(device, request, argument);
  while (result < 0 && errno == EINTR);
  return result;
}

std::vector<VideoMode> video_modes(VideoCalls& calls, int device) {
  std::vector<VideoMode> out;
  for (std::uint32_t k = 0; k < kMostEntries; ++k) {
    v4l2_fmtdesc format{};
    format.index = k;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (video_ioctl(calls, device, VIDIOC_ENUM_FMT, &format) < 0) break;
    add_sizes(calls, device, format.pixelformat, out);
  }
  return out;
}

std::string modes_text(const std::vector<VideoMode>& modes) {
  std::vector<std::string> parts;
  for (const VideoMode& mode : modes) parts.push_back(mode_text(mode));
  return parts.empty() ? "no modes" : fmt::format("{}", fmt::join(parts, ", "));
}

double best_rate(const VideoMode& mode, const StreamRequest& request) {
  double best = 0;
  if (mode.any_between && !mode.fps.empty()) {
    const double wanted = request.fps.value_or(std::min(kUsualFps, mode.fps.front()));
    return wanted <= 1.01 * mode.fps.front() && wanted >= 0.99 * mode.fps.back() ? wanted : 0;
  }
  for (const double fps : mode.fps) {
    if (request.fps ? std::abs(fps - *request.fps) < 0.02 * fps : fps <= kUsualFps) best = std::max(best, fps);
  }
  return best;
}

const VideoMode* choose_mode(const std::vector<VideoMode>& modes, const StreamRequest& request) {
  const VideoMode* best = nullptr;
  double best_fps = -1;
  for (const FourCc pixels : pixel_formats()) {
    if (request.pixels && *request.pixels != pixels) continue;
    for (const VideoMode& mode : modes) {
      if (mode.pixels != pixels || !mode.has_size(request.width, request.height)) continue;
      const double fps = best_rate(mode, request);
      if (fps <= best_fps) continue;
      best = &mode;
      best_fps = fps;
    }
  }
  return best;
}

std::string devices_text(VideoCalls& calls) {
  std::string out;
  for (const std::string& path : calls.devices()) {
    std::vector<VideoMode> modes;
    const auto found = capability(calls, path, &modes);
    if (!found || !found->captures) {
      out += fmt::format("{}: {}\n", path, found ? found->name + " (delivers no images)" : found.error().found);
      continue;
    }
    out += fmt::format("{}: {}\n", path, found->name);
    for (const VideoMode& mode : modes) {
      const bool known = std::ranges::find(pixel_formats(), mode.pixels) != pixel_formats().end();
      out += fmt::format("  {}{}\n", mode_text(mode), known ? "" : ", which bslam does not read");
    }
  }
  return out;
}

std::string devices_in_one_line(VideoCalls& calls) {
  std::vector<std::string> parts;
  for (const std::string& path : calls.devices()) {
    const auto found = capability(calls, path, nullptr);
    if (found && !found->captures) continue;
    parts.push_back(found ? fmt::format("{} ({})", path, found->name) : path);
  }
  return parts.empty() ? "this computer has none" : fmt::format("this computer has {}", fmt::join(parts, ", "));
}

}  // namespace bslam::capture
