#include "capture/played_folders.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <thread>

#include "base/atomic_file.h"
#include "capture/pixels.h"
#include "image_decoding/image_file.h"

namespace bslam::capture {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 28;

std::vector<image_files::NumberedImage> images_of(const fs::path& folder) {
  std::error_code error;
  return image_files::images_in(fs::is_directory(folder / "data", error) ? folder / "data" : folder);
}

// The time at which playback began, and the position in each folder. A folder with a long pause between images is
// opened again, as a camera would be, and continues at its position.
class Playback {
 public:
  explicit Playback(TimeNs first_ns) : first_ns_(first_ns) {}
  Clock::time_point due(TimeNs time_ns) {
    std::call_once(begun_, [this] { start_ = Clock::now(); });
    return start_ + std::chrono::nanoseconds(time_ns - first_ns_);
  }
  // The number of the next image of a folder, for the one device that plays it.
  std::size_t& next_of(const std::string& path) {
    const std::lock_guard lock(mutex_);
    return next_[path];
  }

 private:
  const TimeNs first_ns_;
  std::once_flag begun_;
  Clock::time_point start_;
  std::mutex mutex_;
  std::map<std::string, std::size_t> next_;
};

class PlayedFolder final : public Device {
 public:
  PlayedFolder(std::string path, std::vector<image_files::NumberedImage> images, std::shared_ptr<Playback> playback)
      : path_(std::move(path)),
        images_(std::move(images)),
        playback_(std::move(playback)),
        next_(playback_->next_of(path_)) {}

  Result<Stream> start(const StreamRequest& request) override {
    const auto first = image_decoding::read_image(images_.front().path);
    if (!first) return first.error();
    if (first->width() != request.width || first->height() != request.height) {
      return Error{path_, "", fmt::format("images of {}x{}", first->width(), first->height()),
                   fmt::format("{}x{}, the resolution in the rig file", request.width, request.height)};
    }
    width_ = request.width;
    height_ = request.height;
    const std::string extension = images_.front().path.extension().string();
    jpeg_ = extension == ".jpg" || extension == ".jpeg";
    return Stream{.pixels = jpeg_ ? fourcc("MJPG") : fourcc("GREY"),
                  .width = request.width,
                  .height = request.height,
                  .step = jpeg_ ? 0 : static_cast<std::size_t>(request.width)};
  }

  Result<DeviceImage> read(std::chrono::milliseconds timeout) override {
    if (next_ >= images_.size()) return DeviceImage{.state = DeviceImage::State::kEnd};
    const image_files::NumberedImage& image = images_[next_];
    const Clock::time_point due = playback_->due(image.number), until = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, until));
    if (until < due) return DeviceImage{};
    ++next_;
    auto file = read_file(image.path, kMaxFileBytes);
    bytes_ = file ? *std::move(file) : std::string();
    const auto grey = jpeg_ ? std::nullopt : image_decoding::decode_grey(bytes_);
    if (grey && grey->width() == width_ && grey->height() == height_)
      bytes_.assign(reinterpret_cast<const char*>(grey->row(0)),
                    static_cast<std::size_t>(grey->width()) * static_cast<std::size_t>(grey->height()));
    else if (!jpeg_)
      bytes_.clear();  // no image of this stream
    return DeviceImage{DeviceImage::State::kImage, bytes_, image.number};
  }

 private:
  const std::string path_;
  const std::vector<image_files::NumberedImage> images_;
  const std::shared_ptr<Playback> playback_;
  std::size_t& next_;  // index of the next image, in playback_
  int width_ = 0, height_ = 0;
  bool jpeg_ = false;
  std::string bytes_;
};

}  // namespace

OpenDevice play_folders(const std::vector<std::string>& folders) {
  TimeNs first_ns = std::numeric_limits<TimeNs>::max();
  for (const std::string& folder : folders) {
    const auto images = images_of(folder);
    if (!images.empty()) first_ns = std::min(first_ns, images.front().number);
  }
  return [playback = std::make_shared<Playback>(first_ns)](const std::string& path) -> Result<std::unique_ptr<Device>> {
    auto images = images_of(path);
    if (images.empty()) return Error{path, "", "no images", "images that are named by their time stamps in ns"};
    return std::unique_ptr<Device>(std::make_unique<PlayedFolder>(path, std::move(images), playback));
  };
}

}  // namespace bslam::capture
