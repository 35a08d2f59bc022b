#include "dataset/camera_folders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/lower_case.h"
#include "base/number_text.h"
#include "dataset/image_names.h"
#include "rig_formats/euroc_sensor.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unreadable;
    if (it->is_directory(unreadable) && !it->path().filename().string().starts_with('.')) out.push_back(it->path());
  }
  std::ranges::sort(out, [](const fs::path& a, const fs::path& b) {
    return naturally_before(a.filename().string(), b.filename().string());
  });
  return out;
}

// The folder itself if it has images, else the only folder in it that has; nullopt if there is none, or several.
std::optional<fs::path> images_below(const fs::path& folder) {
  if (!image_files_of(folder).empty()) return folder;
  std::vector<fs::path> inner = folders_in(folder);
  std::erase_if(inner, [](const fs::path& f) { return image_files_of(f).empty(); });
  return inner.size() == 1 ? std::optional(std::move(inner.front())) : std::nullopt;
}

CameraFolder camera_folder(const fs::path& folder) {
  return {folder.filename().string(), images_below(folder).value_or(folder)};
}

// Returns true if a folder has the name of one whose images are no photographs.
bool holds_other_images(const std::string& folder) {
  const std::string name = lower_case(folder);
  return name.find("depth") != std::string::npos || name.find("mask") != std::string::npos ||
         name.find("vignette") != std::string::npos;
}

std::vector<CameraFolder> all_folders(const fs::path& data) {
  std::vector<CameraFolder> out;
  for (const fs::path& folder : folders_in(data)) {
    if (auto images = images_below(folder)) out.push_back({folder.filename().string(), *std::move(images)});
  }
  return out;
}

// cam0, cam1, ..., or left and right if no other folder may be a camera.
std::vector<CameraFolder> usual_folders(const fs::path& data) {
  std::vector<CameraFolder> out;
  for (const fs::path& folder : rig_formats::camera_folders(data, "")) out.push_back(camera_folder(folder));
  if (!out.empty()) return out;
  const auto other = [](const CameraFolder& folder) {
    return folder.name != "left" && folder.name != "right" && !holds_other_images(folder.name);
  };
  if (std::ranges::any_of(all_folders(data), other)) return out;
  std::error_code error;
  for (const char* side : {"left", "right"}) {
    if (fs::is_directory(data / side, error)) out.push_back(camera_folder(data / side));
  }
  return out;
}

Result<CameraFolders> requested_folders(const fs::path& data, const std::vector<std::string>& requested) {
  CameraFolders out{.cameras = {}, .own_names = true};
  std::vector<std::string> names;
  for (const CameraFolder& folder : all_folders(data)) names.push_back(folder.name);
  for (const std::string& name : requested) {
    auto images = images_below(data / name);
    if (!images && !image_files_of(data).empty())
      return Error{"--topics", "", name,
                   "no --topics, since " + data.string() + " has the images of one camera itself"};
    if (!images)
      return Error{"--topics", "", name,
                   fmt::format("folders with images in {}: {}", data.string(), fmt::join(names, ", "))};
    const auto same = [&](const CameraFolder& folder) { return folder.images == *images; };
    if (std::ranges::any_of(out.cameras, same)) return Error{"--topics", "", name + " twice", "each folder once"};
    out.cameras.push_back({name, *std::move(images)});
  }
  return out;
}

std::string not_used(const fs::path& data, const std::vector<std::string>& names, const char* why) {
  return fmt::format("{}: images in {} are not used{} (choose with --topics)", data.string(), fmt::join(names, ", "),
                     why);
}

// Adds a warning that lists the other folders with images.
void warn_of_others(const fs::path& data, CameraFolders& out) {
  std::vector<std::string> others;
  for (const CameraFolder& folder : all_folders(data)) {
    const bool used = std::ranges::find(out.cameras, folder.name, &CameraFolder::name) != out.cameras.end();
    if (!used && !holds_other_images(folder.name)) others.push_back(folder.name);
  }
  if (!others.empty()) out.warnings.push_back(not_used(data, others, ""));
}

}  // namespace

Result<CameraFolders> find_camera_folders(const fs::path& data, const std::vector<std::string>& requested) {
  if (!requested.empty()) return requested_folders(data, requested);
  CameraFolders out{.cameras = usual_folders(data)};
  if (!out.cameras.empty()) {
    warn_of_others(data, out);
    return out;
  }
  out.own_names = true;
  std::vector<std::string> left_out;
  for (CameraFolder& folder : all_folders(data)) {
    if (holds_other_images(folder.name)) {
      left_out.push_back(folder.name);
    } else {
      out.cameras.push_back(std::move(folder));
    }
  }
  if (!left_out.empty())
    out.warnings.push_back(not_used(data, left_out, ", since their names contain depth, mask or vignette"));
  if (out.cameras.empty() && !image_files_of(data).empty()) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(data, error);
    out.cameras.push_back({(error ? data : whole).filename().string(), data});
  }
  return out;
}

std::vector<int> folder_numbers(const std::vector<std::string>& names) {
  constexpr std::string_view kCamera = "cam";
  constexpr int kMaxNumber = 1'000'000;
  std::vector<int> out;
  for (const std::string& name : names) {
    const auto number =
        name.starts_with(kCamera) ? parse_integer(std::string_view(name).substr(kCamera.size())) : std::nullopt;
    if (!number || *number < 0 || *number > kMaxNumber) return {};
    out.push_back(static_cast<int>(*number));
  }
  return out;
}

}  // namespace bslam::dataset
