// Video files, one image at a time. FFmpeg decodes them; its libraries are loaded when the first video is opened, since
// they bring some hundred others with them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"

namespace bslam::video {

struct VideoImage {
  std::string grey;  // rows of 8-bit brightness without gaps
  int width = 0, height = 0;
};

class VideoFile {
 public:
  // Reads the times of all images, without decoding them. Errors: the file cannot be read or contains no video; the
  // codec is not supported; FFmpeg is not installed, or the program was built without it.
  static Result<std::unique_ptr<VideoFile>> open(const std::filesystem::path& path);
  virtual ~VideoFile() = default;

  virtual int width() const = 0;
  virtual int height() const = 0;
  virtual std::string codec() const = 0;  // such as "h264"
  // Presentation times of the images relative to the first one, increasing, in nanoseconds.
  virtual const std::vector<TimeNs>& times() const = 0;
  // Messages for the user about damaged or missing parts.
  virtual const std::vector<std::string>& warnings() const = 0;

  // Returns an image. Reading in order is fast; other orders decode again from the last image that can be decoded
  // alone. May be called from several threads. Errors: the image cannot be decoded.
  virtual Result<VideoImage> read(std::size_t index) = 0;
};

// Returns the version of FFmpeg the program was built with, or an empty string if it was built without.
std::string ffmpeg_version();

}  // namespace bslam::video
