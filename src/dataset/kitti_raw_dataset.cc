// KITTI raw: image_00 to image_03 with data/NNNNNNNNNN.png and timestamps.txt, whose lines are dates; the calibration
// is calib_cam_to_cam.txt of the day, in the folder or the one above.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "dataset/image_names.h"
#include "dataset/listed_images.h"
#include "dataset/recording.h"
#include "rig_formats/rig_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListBytes = std::size_t{1} << 28;
constexpr int kCameras = 4;

std::string folder_name(int camera) { return fmt::format("image_{:02}", camera); }

std::vector<int> cameras_in(const fs::path& folder) {
  std::vector<int> cameras;
  for (int camera = 0; camera < kCameras; ++camera) {
    std::error_code error;
    if (fs::exists(folder / folder_name(camera) / "timestamps.txt", error)) cameras.push_back(camera);
  }
  return cameras;
}

// A whole number of `digits` digits, or nullopt.
std::optional<int> digits_at(std::string_view text, std::size_t at, std::size_t digits) {
  if (at + digits > text.size()) return std::nullopt;
  const std::string_view part = text.substr(at, digits);
  if (part.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  return static_cast<int>(*parse_integer(part));
}

// "2011-09-26 13:02:25.964389445" in nanoseconds since 1970.
std::optional<TimeNs> parse_date(std::string_view line) {
  constexpr std::size_t kWholeSeconds = 19, kMostDigits = 9;
  const auto year = digits_at(line, 0, 4), month = digits_at(line, 5, 2), day = digits_at(line, 8, 2);
  const auto hour = digits_at(line, 11, 2), minute = digits_at(line, 14, 2), second = digits_at(line, 17, 2);
  if (!year || !month || !day || !hour || !minute || !second || line[4] != '-' || line[7] != '-' || line[10] != ' ')
    return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(*year), std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day)));
  if (!date.ok() || *year < 1970 || *year > 2200 || *hour > 23 || *minute > 59 || *second > 60) return std::nullopt;
  std::string fraction(line.size() > kWholeSeconds && line[kWholeSeconds] == '.' ? line.substr(kWholeSeconds + 1) : "");
  if (fraction.size() > kMostDigits || line.size() > kWholeSeconds + 1 + kMostDigits) return std::nullopt;
  fraction.resize(kMostDigits, '0');
  const auto nanoseconds = digits_at(fraction, 0, kMostDigits);
  if (!nanoseconds) return std::nullopt;
  const TimeNs days = std::chrono::sys_days(date).time_since_epoch().count();
  return (((days * 24 + *hour) * 60 + *minute) * 60 + *second) * 1'000'000'000 + *nanoseconds;
}

class KittiRawRecording : public Recording {
 public:
  KittiRawRecording(fs::path root, std::vector<int> cameras) : root_(std::move(root)), cameras_(std::move(cameras)) {}

  std::size_t camera_count() const override { return cameras_.size(); }
  bool has_times() const override { return true; }
  std::vector<int> recorded_numbers() const override { return cameras_; }
  std::vector<std::string> folder_names() const override {
    std::vector<std::string> names;
    for (const int camera : cameras_) names.push_back(folder_name(camera));
    return names;
  }

  Result<camera::RigCamera> calibration(std::size_t camera) const override {
    std::error_code error;
    fs::path file = root_ / "calib_cam_to_cam.txt";
    if (!fs::exists(file, error)) file = fs::absolute(root_, error).lexically_normal().parent_path() / file.filename();
    if (!fs::exists(file, error)) {
      return Error{
          root_.string(), "", "no calib_cam_to_cam.txt", "a rig file (--rig FILE)",
          "no calib_cam_to_cam.txt in " + root_.string() + " or above; specify the calibration with --rig FILE"};
    }
    const auto rig = rig_formats::read_rig(file);
    if (!rig) return rig.error();
    const std::string name = folder_name(cameras_[camera]);
    for (std::size_t c = 0; c < rig->size(); ++c) {  // the file may lack cameras
      if (rig->camera(c).name == name) return camera::RigCamera{rig->camera(c), rig->body_from_cam(c)};
    }
    return Error{file.string(), "", fmt::format("{} cameras", rig->size()),
                 fmt::format("camera {:02}", cameras_[camera])};
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    const fs::path of_camera = root_ / folder_name(cameras_[camera]), folder = of_camera / "data",
                   file = of_camera / "timestamps.txt";
    const auto text = read_text(file, kMaxListBytes);
    if (!text) return text.error();
    std::vector<image_files::ImageFile> images;
    std::istringstream lines(*text);
    std::size_t number = 0;  // of the image and of the lines before this one
    for (std::string line; std::getline(lines, line); ++number) {
      line.erase(line.find_last_not_of(" \r\t") + 1);
      if (line.empty()) continue;  // an image without a time
      const auto time = parse_date(line);
      if (!time) {
        return Error{file.string(), fmt::format("line {}", number + 1), line.substr(0, 60),
                     "a date such as 2011-09-26 13:02:25.964389445"};
      }
      images.push_back({folder / fmt::format("{:010}.png", number), *time});
    }
    if (images.empty()) return Error{file.string(), "", "no times", "the date of every image"};
    return listed_images(std::move(images), file, folder, image_files_of(folder), image_files::StampUnit::kSeconds);
  }

 private:
  fs::path root_;
  std::vector<int> cameras_;  // the numbers of the folders
};

}  // namespace

bool looks_like_kitti_raw(const fs::path& folder) { return !cameras_in(folder).empty(); }

RecordingResult open_kitti_raw(const fs::path& folder) {
  std::vector<int> cameras = cameras_in(folder);
  if (cameras.empty()) return Error{folder.string(), "", "no camera", "image_00 to image_03 with timestamps.txt"};
  return std::unique_ptr<Recording>(std::make_unique<KittiRawRecording>(folder, std::move(cameras)));
}

}  // namespace bslam::dataset
