// Recordings in video files: one per camera, or one with the images of two cameras side by side.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "dataset/recording.h"
#include "video/video_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// The images of all files; the entry of an image is that of its camera and its number in the video.
class VideoStore : public image_files::ImageStore {
 public:
  struct File {
    fs::path path;
    std::unique_ptr<video::VideoFile> video;
  };
  VideoStore(std::vector<File> files, bool side_by_side) : files_(std::move(files)), side_by_side_(side_by_side) {}

  std::size_t camera_count() const { return side_by_side_ ? 2 : files_.size(); }
  const File& file_of(std::size_t camera) const { return files_[side_by_side_ ? 0 : camera]; }
  int width() const { return side_by_side_ ? files_[0].video->width() / 2 : 0; }
  static std::int64_t entry(std::size_t camera, std::size_t number) {
    return static_cast<std::int64_t>(camera << 40 | number);
  }

  Result<image_files::StoredImage> read(std::int64_t entry) const override {
    auto image = file_of(camera_of(entry)).video->read(number_of(entry));
    if (!image) return image.error();
    const int width = side_by_side_ ? image->width / 2 : image->width;
    const std::size_t begin = side_by_side_ && camera_of(entry) == 1 ? static_cast<std::size_t>(width) : 0;
    const std::size_t size = image->grey.size() - begin;
    return image_files::StoredImage{.bytes = std::move(image->grey),
                                    .begin = begin,
                                    .size = size,
                                    .layout = image_files::PixelLayout::kGrey,
                                    .width = width,
                                    .height = image->height,
                                    .step = static_cast<std::size_t>(image->width)};
  }
  std::string name(std::int64_t entry) const override {
    return fmt::format("{}: image {}", source(entry), number_of(entry));
  }
  std::string source(std::int64_t entry) const override {
    const std::string path = file_of(camera_of(entry)).path.string();
    return side_by_side_ ? path + (camera_of(entry) == 0 ? " (left)" : " (right)") : path;
  }
  std::string stream(std::int64_t entry) const override { return source(entry); }

 private:
  static std::size_t camera_of(std::int64_t entry) { return static_cast<std::size_t>(entry) >> 40; }
  static std::size_t number_of(std::int64_t entry) {
    return static_cast<std::size_t>(entry) & ((std::size_t{1} << 40) - 1);
  }
  std::vector<File> files_;
  bool side_by_side_;
};

class VideoRecording : public Recording {
 public:
  explicit VideoRecording(std::shared_ptr<const VideoStore> store) : store_(std::move(store)) {
    const auto count = [&](std::size_t c) { return store_->file_of(c).video->times().size(); };
    for (std::size_t c = 0; c < store_->camera_count(); ++c) {
      const VideoStore::File& file = store_->file_of(c);
      if (c > 0 && &file == &store_->file_of(0)) continue;
      const auto& damage = file.video->warnings();
      warnings_.insert(warnings_.end(), damage.begin(), damage.end());
      if (count(c) != count(0)) {
        warnings_.push_back(fmt::format("{} has {} images but {} has {}; both are used from their first image on",
                                        file.path.string(), count(c), store_->file_of(0).path.string(), count(0)));
      }
    }
  }

  std::size_t camera_count() const override { return store_->camera_count(); }
  bool calibrated() const override { return false; }
  bool has_times() const override { return true; }
  bool in_requested_order() const override { return true; }
  std::vector<std::string> warnings() const override { return warnings_; }

  Result<camera::RigCamera> calibration(std::size_t camera) const override {
    const std::string path = store_->file_of(camera).path.string();
    return Error{path, "", "no calibration", "a rig file (--rig FILE)",
                 "no calibration in " + path + "; specify it with --rig FILE"};
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    image_files::ImageList list;
    const std::vector<TimeNs>& times = store_->file_of(camera).video->times();
    for (std::size_t k = 0; k < times.size(); ++k) {
      list.images.push_back({.path = {}, .time_ns = times[k], .store = store_, .entry = VideoStore::entry(camera, k)});
    }
    return list;
  }

  RecordingDescription describe() const override {
    RecordingDescription out;
    out.format = "video";
    for (std::size_t c = 0; c < camera_count(); ++c) {
      const video::VideoFile& video = *store_->file_of(c).video;
      StreamDescription stream{
          .name = store_->source(VideoStore::entry(c, 0)), .type = "video", .encoding = video.codec()};
      stream.width = store_->width() > 0 ? store_->width() : video.width();
      stream.height = video.height();
      stream.count = video.times().size();
      stream.times = video.times();
      stream.stamps = "video, from its first image";
      stream.camera = static_cast<int>(c);
      out.streams.push_back(std::move(stream));
    }
    return out;
  }

 private:
  std::shared_ptr<const VideoStore> store_;
  std::vector<std::string> warnings_;
};

}  // namespace

RecordingResult open_video(const std::vector<fs::path>& files, bool side_by_side) {
  if (side_by_side && files.size() != 1)
    return Error{"--side-by-side", "", fmt::format("{} videos", files.size()), "one video"};
  std::vector<VideoStore::File> opened;
  for (const fs::path& path : files) {
    if (std::ranges::count(files, path) > 1)
      return Error{path.string(), "", "the same video twice", "a video of each camera"};
    auto video = video::VideoFile::open(path);
    if (!video) return video.error();
    opened.push_back({path, *std::move(video)});
  }
  if (side_by_side && opened[0].video->width() % 2 != 0) {
    return Error{files[0].string(), "--side-by-side", fmt::format("{} pixels in a row", opened[0].video->width()),
                 "an even number"};
  }
  return std::unique_ptr<Recording>(
      std::make_unique<VideoRecording>(std::make_shared<VideoStore>(std::move(opened), side_by_side)));
}

}  // namespace bslam::dataset
