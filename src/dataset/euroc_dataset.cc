// EuRoC: mav0/camN/{data.csv, data/, sensor.yaml} and mav0/state_groundtruth_estimate0/data.csv.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
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

// Returns true for a line such as "timestamp,filename".
bool is_header(std::string_view line) { return line.starts_with("time") || line.starts_with("stamp"); }

// The file in the folder of images. Some lists have the path from the folder of the list.
fs::path listed_file(const fs::path& image_folder, std::string_view name) {
  const fs::path path = name;
  return path.has_parent_path() && path.parent_path() == image_folder.filename() ? image_folder / path.filename()
                                                                                 : image_folder / path;
}

// One line "timestamp [ns],filename" per image. Empty lines, lines that begin with #, and a header are ignored.
Result<std::vector<image_files::ImageFile>> parse_list(const fs::path& file, std::string_view text,
                                                       const fs::path& image_folder) {
  std::vector<image_files::ImageFile> images;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (line.empty() || line.front() == '#' || (number == 1 && is_header(line))) continue;
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
    images.push_back({listed_file(image_folder, name), *time});
  }
  return images;
}

// Images that were converted to another format after the list was written have the same names but for their extensions.
void find_converted(const std::vector<fs::path>& present, std::vector<image_files::ImageFile>& images) {
  std::unordered_set<std::string_view> files;
  for (const fs::path& file : present) files.insert(file.native());
  const auto is_there = [&](const image_files::ImageFile& image) { return files.contains(image.path.native()); };
  if (std::ranges::all_of(images, is_there)) return;
  std::unordered_map<std::string, const fs::path*> by_stem;
  const auto stem_of = [](const fs::path& file) { return (file.parent_path() / file.stem()).string(); };
  for (const fs::path& file : present) by_stem.try_emplace(stem_of(file), &file);
  for (image_files::ImageFile& image : images) {
    if (is_there(image)) continue;
    const auto converted = by_stem.find(stem_of(image.path));
    if (converted != by_stem.end()) image.path = *converted->second;
  }
}

// The images of a folder without a list, whose names are their time stamps.
Result<image_files::ImageList> named_images(const fs::path& folder, const std::vector<fs::path>& present) {
  auto named = images_by_name(folder, present);
  if (!named) return named.error();
  const auto unit = named->in_seconds ? image_files::StampUnit::kSeconds : image_files::StampUnit::kOfFile;
  return image_files::in_time_order(std::move(named->images), folder.string(), unit);
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
    const fs::path folder = folders_[camera] / "data", file = folders_[camera] / "data.csv";
    const std::vector<fs::path> present = image_files_of(folder);
    std::error_code error;
    if (!present.empty() && !fs::exists(file, error)) return named_images(folder, present);
    const auto text = read_text(file, kMaxListBytes);
    if (!text) return text.error();
    auto images = parse_list(file, *text, folder);
    if (!images) return images.error();
    if (images->empty()) return Error{file.string(), "", "no images", "one line timestamp,filename per image"};
    find_converted(present, *images);
    return listed_images(*std::move(images), file, folder, present, image_files::StampUnit::kOfFile);
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
