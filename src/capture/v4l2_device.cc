#include "capture/v4l2_device.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

#include "capture/exposure.h"
#include "capture/pixels.h"
#include "capture/video_modes.h"

namespace bslam::capture {
namespace {

constexpr std::uint32_t kBuffers = 6;
constexpr int kMaxFailures = 20;  // images in a row that could not be fetched, after which the camera is lost

TimeNs monotonic_now() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<TimeNs>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

// Converts a text of the driver, which fills its array or ends with 0.
template <std::size_t N>
std::string text_of(const unsigned char (&text)[N]) {
  const char* const begin = reinterpret_cast<const char*>(text);
  return {begin, ::strnlen(begin, N)};
}

class V4l2Device final : public Device {
 public:
  V4l2Device(VideoCalls& calls, std::string path, int device)
      : calls_(calls), path_(std::move(path)), device_(device) {}
  ~V4l2Device() override;

  Status check();
  Result<Stream> start(const StreamRequest& request) override;
  Result<DeviceImage> read(std::chrono::milliseconds timeout) override;

 private:
  int control(unsigned long request, void* argument) { return video_ioctl(calls_, device_, request, argument); }
  Error failed(const char* what) const;
  Status set_format(const StreamRequest& request, const VideoMode& mode, Stream& stream);
  void set_rate(const StreamRequest& request, const VideoMode& mode, Stream& stream);
  Status map_buffers();
  Status queue(std::uint32_t buffer);
  Result<DeviceImage> fetch();

  struct Memory {
    void* at = nullptr;
    std::size_t length = 0;
  };
  VideoCalls& calls_;
  const std::string path_;
  const int device_;
  std::string identity_;
  TimeNs clock_offset_ns_ = 0;
  std::vector<Memory> buffers_;
  std::optional<std::uint32_t> taken_;  // the buffer whose bytes the caller has
  int failures_ = 0;
};

V4l2Device::~V4l2Device() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!buffers_.empty()) control(VIDIOC_STREAMOFF, &type);
  for (const Memory& memory : buffers_) calls_.munmap(memory.at, memory.length);
  calls_.close(device_);
}

// Returns the error of the last system call.
Error V4l2Device::failed(const char* what) const {
  if (errno == EBUSY)
    return {path_, "", "a camera that another program uses", "a camera that is free",
            path_ + ": another program uses this camera; end it first"};
  if (errno == ENOSPC)
    return {path_, "", "no room for the images", "room for the images",
            path_ +
                ": the USB port has no room for the images of this camera; use --pixels MJPG, a lower --fps or "
                "another port"};
  if (errno == ENODEV) return {path_, "", "a camera that was unplugged", "a camera that is there"};
  return {path_, what, std::strerror(errno), "a camera that streams images"};
}

Status V4l2Device::check() {
  v4l2_capability found{};
  if (control(VIDIOC_QUERYCAP, &found) < 0)
    return Error{path_, "", "no video device", "a camera; " + devices_in_one_line(calls_)};
  identity_ = fmt::format("{} at {}", text_of(found.card), text_of(found.bus_info));
  const std::uint32_t what = found.capabilities & V4L2_CAP_DEVICE_CAPS ? found.device_caps : found.capabilities;
  if ((what & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    const char* kind = what & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? "a device with separate planes of pixels"
                                                            : "a video device that delivers no images";
    return Error{path_, "", kind, "a camera; " + devices_in_one_line(calls_)};
  }
  if ((what & V4L2_CAP_STREAMING) == 0) return Error{path_, "", "a camera without streaming", "a camera that streams"};
  return {};
}

Status V4l2Device::set_format(const StreamRequest& request, const VideoMode& mode, Stream& stream) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(request.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(request.height);
  format.fmt.pix.pixelformat = mode.pixels;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (control(VIDIOC_S_FMT, &format) < 0) return failed("VIDIOC_S_FMT");
  const v4l2_pix_format& set = format.fmt.pix;
  if (static_cast<int>(set.width) != request.width || static_cast<int>(set.height) != request.height ||
      set.pixelformat != mode.pixels) {
    return Error{path_, "",
                 fmt::format("{} {}x{} from the driver", fourcc_text(set.pixelformat), set.width, set.height),
                 fmt::format("{} {}x{}, the resolution in the rig file", fourcc_text(mode.pixels), request.width,
                             request.height)};
  }
  stream.pixels = mode.pixels;
  stream.width = request.width;
  stream.height = request.height;
  const std::size_t row =
      static_cast<std::size_t>(request.width) * static_cast<std::size_t>(bytes_per_pixel(mode.pixels));
  if (!is_jpeg(mode.pixels)) stream.step = std::max<std::size_t>(set.bytesperline, row);
  return {};
}

// The camera may use another rate, for example a lower one in the dark.
void V4l2Device::set_rate(const StreamRequest& request, const VideoMode& mode, Stream& stream) {
  v4l2_streamparm parameters{};
  const auto get = [&] {
    parameters = {};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    return control(VIDIOC_G_PARM, &parameters) >= 0;
  };
  bool known = get();
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  const double wanted = request.fps.value_or(best_rate(mode, request));
  if (known && wanted > 0) {
    interval = {1000, static_cast<std::uint32_t>(std::lround(1000 * wanted))};
    // On failure the structure holds the request, not the accepted values.
    if (control(VIDIOC_S_PARM, &parameters) < 0) known = get();
  }
  if (known && interval.numerator > 0 && interval.denominator > 0)
    stream.fps = static_cast<double>(interval.denominator) / interval.numerator;
  if (request.fps && !(stream.fps && std::abs(*stream.fps - *request.fps) < 0.02 * *request.fps))
    stream.notes.push_back(stream.fps ? fmt::format("{:.4g} frames/s instead of {:.4g}", *stream.fps, *request.fps)
                                      : "the driver cannot set a frame rate");
}

Status V4l2Device::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return control(VIDIOC_QBUF, &buffer) < 0 ? Status(failed("VIDIOC_QBUF")) : Status();
}

Status V4l2Device::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (control(VIDIOC_REQBUFS, &request) < 0) return failed("VIDIOC_REQBUFS");
  if (request.count < 2) return Error{path_, "", "too little memory of the driver", "room for two images"};
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.type = request.type;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (control(VIDIOC_QUERYBUF, &buffer) < 0) return failed("VIDIOC_QUERYBUF");
    void* at = calls_.mmap(device_, buffer.length, buffer.m.offset);
    if (at == MAP_FAILED) return failed("mmap");
    buffers_.push_back({at, buffer.length});
    if (const Status s = queue(index); !s) return s;
  }
  return {};
}

Result<Stream> V4l2Device::start(const StreamRequest& request) {
  clock_offset_ns_ = request.clock_offset_ns;
  const std::vector<VideoMode> modes = video_modes(calls_, device_);
  const VideoMode* mode = choose_mode(modes, request);
  if (mode == nullptr) {
    const std::string wanted = request.pixels ? fourcc_text(*request.pixels) + " " : "";
    return Error{path_, "", modes_text(modes),
                 fmt::format("{}{}x{}, the resolution in the rig file", wanted, request.width, request.height)};
  }
  Stream stream{.identity = identity_};
  if (const Status s = set_format(request, *mode, stream); !s) return s.error();
  set_rate(request, *mode, stream);
  if (const Status s = set_exposure(calls_, device_, path_, request); !s) return s.error();
  if (const Status s = map_buffers(); !s) return s.error();
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (control(VIDIOC_STREAMON, &type) < 0) return failed("VIDIOC_STREAMON");
  return stream;
}

Result<DeviceImage> V4l2Device::read(std::chrono::milliseconds timeout) {
  if (taken_) {
    const std::uint32_t before = *taken_;
    taken_.reset();
    if (const Status s = queue(before); !s) return s.error();
  }
  const int ready = calls_.poll(device_, timeout);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return DeviceImage{};
  if (ready < 0) return failed("poll");
  return fetch();
}

Result<DeviceImage> V4l2Device::fetch() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (control(VIDIOC_DQBUF, &buffer) < 0) {
    if (errno == EAGAIN) return DeviceImage{};
    // The driver lost an image; the next one may be good.
    if (errno == EIO && ++failures_ < kMaxFailures) return DeviceImage{.state = DeviceImage::State::kDamaged};
    return failed("VIDIOC_DQBUF");
  }
  if (buffer.index >= buffers_.size()) return Error{path_, "", "a buffer that does not exist", "a working driver"};
  taken_ = buffer.index;
  failures_ = 0;
  if (buffer.flags & V4L2_BUF_FLAG_ERROR) return DeviceImage{.state = DeviceImage::State::kDamaged};
  const Memory& memory = buffers_[buffer.index];
  const std::size_t size = std::min<std::size_t>(buffer.bytesused, memory.length);
  const bool stamped = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const TimeNs stamp_ns = static_cast<TimeNs>(buffer.timestamp.tv_sec) * 1'000'000'000 +
                          static_cast<TimeNs>(buffer.timestamp.tv_usec) * 1'000;
  return DeviceImage{DeviceImage::State::kImage,
                     {static_cast<const char*>(memory.at), size},
                     (stamped ? stamp_ns : monotonic_now()) + clock_offset_ns_,
                     stamped};
}

}  // namespace

Result<std::unique_ptr<Device>> open_v4l2(VideoCalls& calls, const std::string& path) {
  const int device = calls.open(path.c_str());
  if (device < 0 && (errno == EACCES || errno == EPERM)) {
    return Error{path, "", "no permission to use this camera", "a member of the group video",
                 path +
                     ": no permission to use this camera; add yourself to the group video (sudo usermod -aG video "
                     "$USER) and log in again"};
  }
  if (device < 0 && errno == EBUSY)
    return Error{path, "", "", "", path + ": another program uses this camera; end it first"};
  if (device < 0) {
    const bool missing = errno == ENOENT || errno == ENODEV || errno == ENXIO;
    return Error{path, "", missing ? "no such camera" : std::strerror(errno),
                 "a camera; " + devices_in_one_line(calls)};
  }
  auto camera = std::make_unique<V4l2Device>(calls, path, device);
  if (const Status s = camera->check(); !s) return s.error();
  return std::unique_ptr<Device>(std::move(camera));
}

}  // namespace bslam::capture
