// A camera that delivers images one after the other.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/timestamp.h"

namespace bslam::capture {

// How the pixels of an image lie in memory: one of kPixelFormats.
using FourCc = std::uint32_t;

// The requested settings of a camera.
struct StreamRequest {
  int width = 0, height = 0;          // pixels
  std::optional<double> fps = {};     // default: the highest up to 60 that the format offers
  std::optional<FourCc> pixels = {};  // default: the one that needs least conversion at this rate
  enum class Exposure { kAsItIs, kAutomatic, kFixed } exposure = Exposure::kAsItIs;
  int exposure_us = 0;         // microseconds, if the exposure is fixed
  TimeNs clock_offset_ns = 0;  // added to times of CLOCK_MONOTONIC
};

// The settings that a camera has accepted.
struct Stream {
  FourCc pixels = 0;
  int width = 0, height = 0;
  std::size_t step = 0;                 // bytes from one row to the next; 0 for whole files
  std::optional<double> fps = {};       // nullopt: unknown
  std::vector<std::string> notes = {};  // messages for the user about differences from the request
  // "NAME at PORT", to recognise the camera after a reconnect; empty: only its path identifies it.
  std::string identity = {};
};

struct DeviceImage {
  enum class State { kImage, kNone, kDamaged, kEnd } state = State::kNone;  // kNone: none came in time
  std::string_view bytes = {};                                              // valid until the next call
  TimeNs time_ns = 0;
  bool stamped = true;  // false: the driver has no time stamps, and `time_ns` is when the image was fetched
};

class Device {
 public:
  virtual ~Device() = default;

  // Sets the camera up and starts it. Called once. Errors: the camera does not offer what is asked, is in use, ...
  virtual Result<Stream> start(const StreamRequest& request) = 0;

  // Waits for the next image. Error: the camera was lost; it has to be opened again.
  virtual Result<DeviceImage> read(std::chrono::milliseconds timeout) = 0;
};

// Opens a camera by its path. Errors: it does not exist, may not be opened, or is no camera.
using OpenDevice = std::function<Result<std::unique_ptr<Device>>(const std::string& path)>;

}  // namespace bslam::capture
