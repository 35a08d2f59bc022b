// EuRoC: mav0/camN/{data.csv, data/, sensor.yaml} and mav0/state_groundtruth_estimate0/data.csv.
#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "dataset/camera_folders.h"
#include "dataset/image_names.h"
#include "dataset/listed_images.h"
#include "dataset/recording.h"
#include "rig_formats/euroc_sensor.h"
#include "rig_formats/rig_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListBytes = std::size_t{1} << 28;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// One line "timestamp [ns],filename" per image. Empty lines and lines that begin with # are ignored.
Result<std::vector<image_files::ImageFile>> parse_list(const fs::path& file, std::string_view text,
                                                       const fs::path& image_folder) {
  std::vector<image_files::ImageFile> images;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (line.empty() || line.front() == '#') continue;
    const auto error = [&](std::string_view found, std::string expected) {
      return Error{file.string(), fmt::format("line {}", number), std::string(found.substr(0, 60)),
                   std::move(expected)};
    };
    const std::size_t comma = line.find(',');
    const auto time = parse_integer(trimmed(line.substr(0, comma)));
    if (!time || *time < 0 || *time > kMaxTime) return error(line.substr(0, comma), "a time stamp in nanoseconds");
    const std::string_view rest = comma == std::string_view::npos ? "" : line.substr(comma + 1);
    const std::string_view name = trimmed(rest.substr(0, rest.find(',')));
    if (name.empty()) return error(line, "timestamp,filename");
    images.push_back({image_folder / name, *time});
  }
  return images;
}

class EurocRecording : public Recording {
 public:
  EurocRecording(fs::path root, std::vector<fs::path> folders) : root_(std::move(root)), folders_(std::move(folders)) {}

  std::size_t camera_count() const override { return folders_.size(); }

  bool calibrated() const override {
    std::error_code error;
    return std::ranges::any_of(folders_, [&](const fs::path& f) { return fs::exists(f / "sensor.yaml", error); });
  }

  Result<camera::RigCamera> calibration(std::size_t camera) const override {
    return rig_formats::read_euroc_sensor(folders_[camera] / "sensor.yaml", folders_[camera].filename().string());
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    const fs::path file = folders_[camera] / "data.csv";
    const auto text = read_text(file, kMaxListBytes);
    if (!text) return text.error();
    auto images = parse_list(file, *text, folders_[camera] / "data");
    if (!images) return images.error();
    if (images->empty()) return Error{file.string(), "", "no images", "one line timestamp,filename per image"};
    const fs::path folder = folders_[camera] / "data";
    return listed_images(*std::move(images), file, folder, image_files_of(folder), image_files::StampUnit::kOfFile);
  }

  // bslam simulate numbers the folders in the order of the rig, whose cameras may have other names.
  std::vector<std::string> folder_names() const override {
    std::vector<std::string> names = names_on_disk();
    std::error_code error;
    const fs::path data = root_.parent_path();
    if (!fs::exists(data / rig_formats::kComplete, error)) return names;
    const auto rig = rig_formats::read_rig(data / "rig.yaml");
    const std::vector<int> numbers = folder_numbers(names);
    for (std::size_t c = 0; rig && c < numbers.size(); ++c) {
      const auto number = static_cast<std::size_t>(numbers[c]);
      if (number < rig->size()) names[c] = rig->camera(number).name;
    }
    return names;
  }
  std::vector<int> recorded_numbers() const override { return folder_numbers(names_on_disk()); }

  std::optional<fs::path> ground_truth() const override {
    fs::path file = root_ / "state_groundtruth_estimate0" / "data.csv";
    fs::path of_camera0 = root_.parent_path() / "groundtruth_cam0.tum";
    std::error_code error;
    if (fs::exists(file, error)) return file;
    return fs::exists(of_camera0, error) ? std::optional(std::move(of_camera0)) : std::nullopt;
  }

 private:
  std::vector<std::string> names_on_disk() const {
    std::vector<std::string> names;
    for (const fs::path& folder : folders_) names.push_back(folder.filename().string());
    return names;
  }

  fs::path root_;
  std::vector<fs::path> folders_;
};

bool partly_written(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / rig_formats::kPartial, error) && !fs::exists(folder / rig_formats::kComplete, error);
}

}  // namespace

// A folder camN that holds its images beside data.csv is not EuRoC's.
bool looks_like_euroc(const fs::path& folder) {
  std::error_code error;
  return fs::is_directory(folder / "mav0", error) ||
         std::ranges::any_of(rig_formats::camera_folders(folder, "data.csv"), [&](const fs::path& camera) {
           return fs::is_directory(camera / "data", error) || fs::exists(camera / "sensor.yaml", error);
         });
}

RecordingResult open_euroc(const fs::path& folder) {
  const fs::path root = rig_formats::euroc_root(folder);
  if (partly_written(root.parent_path())) {
    return Error{root.parent_path().string(), "", "a recording of which bslam simulate wrote only a part",
                 "a complete one: the command that began it continues"};
  }
  auto folders = rig_formats::camera_folders(root, "");
  if (folders.empty()) return Error{root.string(), "", "no camera", "cam0, cam1, ... with data.csv and sensor.yaml"};
  return std::unique_ptr<Recording>(std::make_unique<EurocRecording>(root, std::move(folders)));
}

}  // namespace bslam::dataset
