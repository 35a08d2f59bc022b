// KITTI odometry: image_0 to image_3 with NNNNNN.png, times.txt, calib.txt, poses.txt.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "base/atomic_file.h"
#include "dataset/recording.h"
#include "dataset/time_stamps.h"
#include "evaluation/trajectory_file.h"
#include "image/frame_grouping.h"
#include "rig_formats/kitti_calib.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListBytes = std::size_t{1} << 28;
constexpr int kCameras = 4;

Result<std::vector<TimeNs>> read_times(const fs::path& file) {
  const auto text = read_text(file, kMaxListBytes);
  if (!text) return text.error();
  std::vector<TimeNs> times;
  std::istringstream lines(*text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::string word, more;
    std::istringstream words(line);
    if (!(words >> word)) continue;
    const auto time = evaluation::parse_seconds(word);
    if (!time || words >> more)
      return Error{file.string(), fmt::format("line {}", number), line.substr(0, 60), "seconds"};
    times.push_back(*time);
  }
  if (times.empty()) return Error{file.string(), "", "no times", "the time of every image in seconds, one per line"};
  if (times.size() < 2) return times;
  if (const TimeNs interval_ns = image::median_interval(times);
      interval_ns < kShortestInterval || interval_ns > kLongestInterval)
    return Error{file.string(), "", fmt::format("times {:g} s apart", to_seconds(interval_ns)),
                 "the time of every image in seconds"};
  return times;
}

std::string usual_name(std::size_t number) { return fmt::format("{:06}.png", number); }

class KittiRecording : public Recording {
 public:
  KittiRecording(fs::path root, std::vector<int> cameras) : root_(std::move(root)), cameras_(std::move(cameras)) {}

  std::size_t camera_count() const override { return cameras_.size(); }

  Result<camera::RigCamera> calibration(std::size_t camera) const override {
    const fs::path file = root_ / "calib.txt";
    const auto projections = rig_formats::read_kitti_calib(file);
    if (!projections) return projections.error();
    for (const rig_formats::KittiProjection& projection : *projections) {
      if (projection.camera != cameras_[camera]) continue;
      const fs::path folder = rig_formats::kitti_image_folder(root_, projection.camera);
      const auto size = image_files::first_image_size(image_files::images_in(folder));
      if (!size)
        return Error{folder.string(), "", "no image that can be read",
                     "an image, since calib.txt does not contain the resolution"};
      return rig_formats::kitti_camera(projection, size->width, size->height, file);
    }
    return Error{file.string(), "", fmt::format("no line P{}", cameras_[camera]),
                 "the projection of every camera, twelve numbers each"};
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    const fs::path folder = rig_formats::kitti_image_folder(root_, cameras_[camera]);
    const auto times = read_times(root_ / "times.txt");
    if (!times) return times.error();
    std::vector<image_files::ImageFile> images;
    for (std::size_t k = 0; k < times->size(); ++k) {
      images.push_back({folder / usual_name(k), (*times)[k]});  // replaced below if the file has another name
    }
    std::size_t without_time = 0;
    std::vector<fs::path> again;  // with the number of another file
    std::vector<bool> found(images.size(), false);
    for (image_files::NumberedImage& image : image_files::images_in(folder)) {
      const auto k = static_cast<std::size_t>(image.number);
      if (k >= images.size()) {
        ++without_time;
      } else if (found[k] && image.path != folder / usual_name(k)) {
        again.push_back(std::move(image.path));
      } else {
        if (found[k]) again.push_back(images[k].path);
        found[k] = true;
        images[k].path = std::move(image.path);
      }
    }
    image_files::ImageList list =
        image_files::in_time_order(std::move(images), (root_ / "times.txt").string(), image_files::StampUnit::kSeconds);
    if (without_time > 0) {
      list.warnings.push_back(
          fmt::format("{}: {} images have no time in times.txt and are not used", folder.string(), without_time));
    }
    if (!again.empty()) {
      list.warnings.push_back(
          fmt::format("{}: {} images have the number of another file and are not used, the first: {}", folder.string(),
                      again.size(), std::ranges::min(again).filename().string()));
    }
    return list;
  }

  bool has_times() const override { return true; }
  std::vector<int> recorded_numbers() const override { return cameras_; }
  std::vector<std::string> folder_names() const override {
    std::vector<std::string> names;
    for (const int camera : cameras_) names.push_back(rig_formats::kitti_image_folder(root_, camera).filename());
    return names;
  }

  std::optional<fs::path> ground_truth() const override {
    fs::path file = root_ / "poses.txt";
    std::error_code error;
    return fs::exists(file, error) ? std::optional(std::move(file)) : std::nullopt;
  }

 private:
  fs::path root_;
  std::vector<int> cameras_;  // the numbers N of the folders image_N
};

std::vector<int> cameras_in(const fs::path& folder) {
  std::vector<int> cameras;
  for (int camera = 0; camera < kCameras; ++camera) {
    std::error_code error;
    if (fs::is_directory(rig_formats::kitti_image_folder(folder, camera), error)) cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace

bool looks_like_kitti(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / "times.txt", error) && !cameras_in(folder).empty();
}

RecordingResult open_kitti(const fs::path& folder) {
  std::vector<int> cameras = cameras_in(folder);
  if (cameras.empty())
    return Error{folder.string(), "", "no camera",
                 "at least one folder of image_0 ... image_3, with times.txt and calib.txt"};
  return std::unique_ptr<Recording>(std::make_unique<KittiRecording>(folder, std::move(cameras)));
}

}  // namespace bslam::dataset
