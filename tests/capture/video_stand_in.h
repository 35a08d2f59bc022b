// Stands in for the kernel and its cameras: V4L2 devices that behave as the tests ask.
#pragma once

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "capture/video_calls.h"

namespace bslam::capture {

// What becomes of a call that fetches an image.
struct StandInImage {
  std::string bytes = {};
  std::int64_t time_us = 0;
  int error = 0;  // errno of the call instead of an image
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
};

struct StandInCamera {
  struct Mode {
    std::uint32_t pixels = 0;
    std::uint32_t width = 0, height = 0;
    std::vector<std::uint32_t> fps;
  };
  std::string name = "test camera", port = "usb-1";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<Mode> modes;
  std::map<std::uint32_t, int> controls;  // those that it has
  int least_exposure = 1, most_exposure = 5000;
  std::deque<StandInImage> images;
  int open_error = 0, format_error = 0, memory_error = 0, stream_error = 0;
  std::uint32_t forced_width = 0;  // of the driver, whatever is asked
  std::uint32_t extra_step = 0;    // bytes between rows
  std::uint32_t set_fps = 30;
  bool rate_can_be_set = true;
  int rate_error = 0;  // errno of setting the rate
  // What was done to it.
  int opened = 0, closed = 0, mapped = 0, unmapped = 0;
  bool streaming = false;
  std::vector<std::uint32_t> queued;
  std::vector<std::vector<char>> memory;
  v4l2_pix_format format{};
};

class VideoStandIn : public VideoCalls {
 public:
  std::map<std::string, StandInCamera> cameras;

  int open(const char* path) override {
    const auto found = cameras.find(path);
    if (found == cameras.end()) return errno = ENOENT, -1;
    if (found->second.open_error != 0) return errno = found->second.open_error, -1;
    ++found->second.opened;
    open_.push_back(&found->second);
    return static_cast<int>(open_.size()) - 1;
  }
  int close(int device) override { return ++at(device).closed, 0; }
  void* mmap(int device, std::size_t length, std::int64_t offset) override {
    StandInCamera& camera = at(device);
    if (length != camera.memory.at(static_cast<std::size_t>(offset)).size()) return MAP_FAILED;
    ++camera.mapped;
    return camera.memory[static_cast<std::size_t>(offset)].data();
  }
  int munmap(void* memory, std::size_t) override {
    for (auto& [path, camera] : cameras) {
      for (auto& buffer : camera.memory) camera.unmapped += buffer.data() == memory;
    }
    return 0;
  }
  int poll(int device, std::chrono::milliseconds) override { return at(device).images.empty() ? 0 : 1; }
  std::vector<std::string> devices() override {
    std::vector<std::string> out;
    for (const auto& [path, camera] : cameras) out.push_back(path);
    return out;
  }

  int ioctl(int device, unsigned long request, void* argument) override {
    if (interrupted_++ % 3 == 0) return errno = EINTR, -1;  // calls may be interrupted at any time
    const int error = call(at(device), request, argument);
    return error == 0 ? 0 : (errno = error, -1);
  }

 private:
  StandInCamera& at(int device) { return *open_.at(static_cast<std::size_t>(device)); }

  static int call(StandInCamera& c, unsigned long request, void* argument) {
    switch (request) {
      case VIDIOC_QUERYCAP:
        return capability(c, *static_cast<v4l2_capability*>(argument));
      case VIDIOC_ENUM_FMT:
        return format_at(c, *static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_ENUM_FRAMESIZES:
        return size_at(c, *static_cast<v4l2_frmsizeenum*>(argument));
      case VIDIOC_ENUM_FRAMEINTERVALS:
        return interval_at(c, *static_cast<v4l2_frmivalenum*>(argument));
      case VIDIOC_S_FMT:
        return set_format(c, static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:
        return rate(c, request == VIDIOC_S_PARM, static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe);
      case VIDIOC_QUERYCTRL:
        return control_range(c, *static_cast<v4l2_queryctrl*>(argument));
      case VIDIOC_S_CTRL:
        return set_control(c, *static_cast<v4l2_control*>(argument));
      case VIDIOC_REQBUFS:
        return make_buffers(c, *static_cast<v4l2_requestbuffers*>(argument));
      case VIDIOC_QUERYBUF:
        return describe_buffer(c, *static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF:
        return c.queued.push_back(static_cast<v4l2_buffer*>(argument)->index), 0;
      case VIDIOC_DQBUF:
        return fetch(c, *static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        return c.streaming = c.stream_error == 0, c.stream_error;
      case VIDIOC_STREAMOFF:
        return c.streaming = false, 0;
      default:
        return ENOTTY;
    }
  }

  static int capability(StandInCamera& c, v4l2_capability& out) {
    if (c.capabilities == 0) return ENOTTY;
    std::strncpy(reinterpret_cast<char*>(out.card), c.name.c_str(), sizeof(out.card) - 1);
    std::strncpy(reinterpret_cast<char*>(out.bus_info), c.port.c_str(), sizeof(out.bus_info) - 1);
    out.capabilities =
        V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;  // of all nodes of the device
    out.device_caps = c.capabilities;
    return 0;
  }
  static std::vector<std::uint32_t> formats(const StandInCamera& c) {
    std::vector<std::uint32_t> out;
    for (const auto& mode : c.modes) {
      if (std::find(out.begin(), out.end(), mode.pixels) == out.end()) out.push_back(mode.pixels);
    }
    return out;
  }
  static int format_at(StandInCamera& c, v4l2_fmtdesc& out) {
    const auto all = formats(c);
    if (out.index >= all.size()) return EINVAL;
    out.pixelformat = all[out.index];
    return 0;
  }
  static int size_at(StandInCamera& c, v4l2_frmsizeenum& out) {
    std::uint32_t index = out.index;
    for (const auto& mode : c.modes) {
      if (mode.pixels != out.pixel_format || mode.width == 0 || index-- > 0) continue;
      out.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      out.discrete = {mode.width, mode.height};
      return 0;
    }
    return EINVAL;
  }
  static int interval_at(StandInCamera& c, v4l2_frmivalenum& out) {
    for (const auto& mode : c.modes) {
      if (mode.pixels != out.pixel_format || mode.width != out.width || mode.height != out.height) continue;
      if (out.index >= mode.fps.size()) return EINVAL;
      out.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      out.discrete = {1, mode.fps[out.index]};
      return 0;
    }
    return EINVAL;
  }
  static int set_format(StandInCamera& c, v4l2_pix_format& pix) {
    if (c.format_error != 0) return c.format_error;
    if (c.forced_width != 0) pix.width = c.forced_width;
    const bool pairs = pix.pixelformat == V4L2_PIX_FMT_YUYV || pix.pixelformat == V4L2_PIX_FMT_UYVY;
    pix.bytesperline = pix.width * (pairs ? 2 : 1) + c.extra_step;
    pix.sizeimage = pix.bytesperline * pix.height * 2;
    c.format = pix;
    return 0;
  }
  static int rate(StandInCamera& c, bool set, v4l2_fract& interval) {
    if (set && c.rate_error != 0) return c.rate_error;
    if (set && c.rate_can_be_set) c.set_fps = interval.denominator / interval.numerator;
    interval = {1, c.set_fps};
    return 0;
  }
  static int control_range(StandInCamera& c, v4l2_queryctrl& out) {
    if (!c.controls.contains(out.id)) return EINVAL;
    out.minimum = c.least_exposure;
    out.maximum = c.most_exposure;
    return 0;
  }
  static int set_control(StandInCamera& c, const v4l2_control& control) {
    if (!c.controls.contains(control.id)) return EINVAL;
    if (control.id == V4L2_CID_EXPOSURE_AUTO && control.value == V4L2_EXPOSURE_AUTO) return EINVAL;  // as USB cameras
    c.controls[control.id] = control.value;
    return 0;
  }
  static int make_buffers(StandInCamera& c, v4l2_requestbuffers& request) {
    if (c.memory_error != 0) return c.memory_error;
    request.count = 3;  // fewer than asked for
    c.memory.assign(request.count, std::vector<char>(c.format.sizeimage));
    return 0;
  }
  static int describe_buffer(StandInCamera& c, v4l2_buffer& buffer) {
    if (buffer.index >= c.memory.size()) return EINVAL;
    buffer.length = static_cast<std::uint32_t>(c.memory[buffer.index].size());
    buffer.m.offset = buffer.index;
    return 0;
  }
  static int fetch(StandInCamera& c, v4l2_buffer& buffer) {
    if (c.images.empty() || !c.streaming) return EAGAIN;
    const StandInImage image = c.images.front();
    c.images.pop_front();
    if (image.error != 0) return image.error;
    if (c.queued.empty()) return EAGAIN;
    buffer.index = c.queued.front();
    c.queued.erase(c.queued.begin());
    std::memcpy(c.memory[buffer.index].data(), image.bytes.data(), image.bytes.size());
    buffer.bytesused = static_cast<std::uint32_t>(image.bytes.size());
    buffer.flags = image.flags;
    buffer.timestamp = {image.time_us / 1'000'000, image.time_us % 1'000'000};
    return 0;
  }

  std::vector<StandInCamera*> open_;
  int interrupted_ = 0;
};

}  // namespace bslam::capture
