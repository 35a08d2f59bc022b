#include "dataset/recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <system_error>

#include "base/split.h"
#include "dataset/bag_recording.h"
#include "image_decoding/image_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// The format of a folder if it contains files by which one format is recognised without doubt.
std::optional<DatasetFormat> distinct_format(const fs::path& folder) {
  if (looks_like_euroc(folder)) return DatasetFormat::kEuroc;
  if (looks_like_kitti(folder) || looks_like_kitti_raw(folder)) return DatasetFormat::kKitti;
  if (looks_like_folder(folder)) return DatasetFormat::kFolder;
  if (looks_like_bag(folder)) return DatasetFormat::kBag;
  return std::nullopt;
}

std::optional<DatasetFormat> known_format(const fs::path& folder) {
  if (const auto distinct = distinct_format(folder)) return distinct;
  if (has_folders_of_images(folder)) return DatasetFormat::kFolder;
  return std::nullopt;
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  constexpr std::size_t kMost = 100;  // number of entries that are examined
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && out.size() < kMost; it.increment(error)) {
    std::error_code unreadable;
    if (it->is_directory(unreadable)) out.push_back(it->path());
  }
  std::ranges::sort(out);
  return out;
}

// The folders one or two levels below `folder` that look like recordings, relative to it.
std::vector<std::string> recordings_below(const fs::path& folder) {
  std::vector<std::string> out;
  for (const fs::path& outer : folders_in(folder)) {
    std::vector<fs::path> tried = {outer};
    if (!known_format(outer)) tried = folders_in(outer);
    for (const fs::path& inner : tried) {
      if (known_format(inner)) out.push_back(inner.lexically_relative(folder).string());
    }
  }
  return out;
}

Result<DatasetFormat> detect_format(const fs::path& folder) {
  constexpr std::size_t kShown = 3;
  if (const auto distinct = distinct_format(folder)) return *distinct;
  std::vector<std::string> below = recordings_below(folder);
  const bool images_only =
      std::ranges::none_of(below, [&](const std::string& name) { return distinct_format(folder / name).has_value(); });
  // Folders of images are either recordings or the cameras of one.
  if (images_only && has_folders_of_images(folder)) return DatasetFormat::kFolder;
  if (!below.empty()) {
    const std::size_t more = below.size() - std::min(below.size(), kShown);
    below.resize(below.size() - more);
    return Error{folder.string(), "",
                 fmt::format("no recording, but folders that look like one in {}{}", fmt::join(below, ", "),
                             more > 0 ? fmt::format(" and {} more", more) : ""),
                 "one of them: " + (folder / below.front()).string()};
  }
  return Error{
      folder.string(), "", "no data set of a known format",
      "mav0/camN/data.csv (euroc), image_N with times.txt or image_NN with timestamps.txt (kitti), a folder of "
      "images for each camera (folder), or a ROS 2 bag (metadata.yaml)"};
}

// Splits a list of files at its commas, unless there is a file with commas in its name.
std::vector<fs::path> files_of(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error)) return {path};
  std::vector<fs::path> files;
  for (const std::string& part : split(path.string(), ',')) {
    if (!part.empty()) files.emplace_back(part);
  }
  return files.empty() ? std::vector<fs::path>{path} : files;
}

Status check_bag_options(const DatasetRequest& request, DatasetFormat format) {
  if (!request.topics.empty() && format != DatasetFormat::kBag && format != DatasetFormat::kFolder)
    return Error{"--topics", "", "data without topics", "a ROS bag, an MCAP file, or folders of images (folder)"};
  if (request.side_by_side && format != DatasetFormat::kVideo)
    return Error{"--side-by-side", "", "data that is no video", "a video"};
  return {};
}

Result<DatasetFormat> format_of(const DatasetRequest& request, const std::vector<fs::path>& files) {
  std::error_code error;
  if (fs::is_directory(files.front(), error) && files.size() == 1)
    return request.format == DatasetFormat::kAuto ? detect_format(files.front()) : request.format;
  for (const fs::path& file : files) {
    if (!fs::exists(file, error)) return Error{file.string(), "", "no such file or folder", "a recording"};
    if (fs::is_directory(file, error))
      return Error{file.string(), "", "a folder among files", "files joined by commas"};
  }
  const DatasetFormat found = looks_like_bag(files.front()) ? DatasetFormat::kBag : DatasetFormat::kVideo;
  if (request.format == DatasetFormat::kAuto || request.format == found) return found;
  return Error{files.front().string(), "", "a file", "the folder of a data set"};
}

// KITTI odometry, or the raw data of a day.
RecordingResult open_kitti_of_any_kind(const fs::path& folder) {
  return looks_like_kitti_raw(folder) && !looks_like_kitti(folder) ? open_kitti_raw(folder) : open_kitti(folder);
}

}  // namespace

std::string_view format_name(DatasetFormat format) {
  switch (format) {
    case DatasetFormat::kAuto:
      return "auto";
    case DatasetFormat::kEuroc:
      return "euroc";
    case DatasetFormat::kKitti:
      return "kitti";
    case DatasetFormat::kFolder:
      return "folder";
    case DatasetFormat::kBag:
      return "bag";
    case DatasetFormat::kVideo:
      return "video";
  }
  return "";
}

Result<OpenRecording> open_recording(const DatasetRequest& request) {
  const std::vector<fs::path> files = files_of(request.path);
  const auto format = format_of(request, files);
  if (!format) return format.error();
  if (const Status s = check_bag_options(request, *format); !s) return s.error();
  auto recording = *format == DatasetFormat::kEuroc    ? open_euroc(files.front())
                   : *format == DatasetFormat::kKitti  ? open_kitti_of_any_kind(files.front())
                   : *format == DatasetFormat::kFolder ? open_folder(files.front(), request.topics, request.time_stamps)
                   : *format == DatasetFormat::kBag    ? open_bag(files, request.topics)
                                                       : open_video(files, request.side_by_side);
  if (!recording) return recording.error();
  return OpenRecording{*format, *std::move(recording)};
}

RecordingDescription Recording::describe() const {
  RecordingDescription out;
  for (std::size_t c = 0; c < camera_count(); ++c) {
    StreamDescription stream{.name = "", .type = "images", .encoding = ""};
    const auto list = images(c);
    if (!list) {
      const std::vector<std::string> names = folder_names();
      stream.name = c < names.size() ? names[c] : fmt::format("camera {}", c);
      stream.unused = list.error().message();
      out.missing.push_back(stream.unused);
      out.streams.push_back(std::move(stream));
      continue;
    }
    out.warnings.insert(out.warnings.end(), list->warnings.begin(), list->warnings.end());
    stream.name = image_files::source_of(list->images.front());
    stream.count = list->images.size();
    for (const image_files::ImageFile& image : list->images) stream.times.push_back(image.time_ns);
    stream.stamps = stamps_from(c);
    stream.camera = static_cast<int>(c);
    stream.calibrated = calibration(c).ok();
    stream.encoding = list->images.front().path.extension().string();
    stream.encoding.erase(0, stream.encoding.starts_with('.') ? 1 : 0);
    constexpr std::size_t kTries = 5;
    for (std::size_t k = 0; k < std::min(kTries, list->images.size()) && stream.width == 0; ++k) {
      const auto image = image_decoding::read_image(list->images[k]);
      if (!image) continue;
      stream.width = image->width();
      stream.height = image->height();
    }
    out.streams.push_back(std::move(stream));
  }
  return out;
}

}  // namespace bslam::dataset
