#include "dataset/mask_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/number_text.h"
#include "image_decoding/image_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCamera = "cam", kExtension = ".png";

std::string name_of(int camera) { return fmt::format("{}{}", kCamera, camera); }

// The number of the camera to whose masks a file or a folder belongs by its name.
std::optional<std::uint64_t> number_of(std::string_view name, bool is_folder) {
  if (!is_folder && !name.ends_with(kExtension)) return std::nullopt;
  const std::string_view stem = name.substr(0, name.size() - (is_folder ? 0 : kExtension.size()));
  const auto number = stem.starts_with(kCamera) ? parse_integer(stem.substr(kCamera.size())) : std::nullopt;
  if (!number || *number < 0 || stem.substr(kCamera.size()) != std::to_string(*number)) return std::nullopt;
  return static_cast<std::uint64_t>(*number);
}

}  // namespace

Result<camera::Rig> with_masks(const camera::Rig& rig, const std::vector<int>& cameras, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return Error{folder.string(), "--masks", "no such folder", "a folder with masks camN.png or camN/STAMP.png"};
  std::vector<camera::RigCamera> masked;
  bool any = false;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    camera::Camera camera = rig.camera(i);
    const fs::path file = folder / fmt::format("{}{}", name_of(cameras[i]), kExtension);
    any |= fs::is_directory(folder / name_of(cameras[i]), error);
    if (fs::exists(file, error)) {
      camera.mask_file = file.string();
      any = true;
    }
    masked.push_back({std::move(camera), rig.body_from_cam(i)});
  }
  if (!any) {
    const std::string name = name_of(cameras.front());
    return Error{folder.string(), "--masks", "no mask of a camera in use",
                 fmt::format("{}.png, {}/STAMP.png or those of another camera", name, name)};
  }
  return camera::Rig(std::move(masked), rig.cam_from_rig(0));
}

std::vector<std::string> masks_not_used(const fs::path& folder, std::size_t count) {
  std::vector<std::string> of_no_camera, others;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unknown;
    const bool is_folder = it->is_directory(unknown);
    if (!(is_folder ? !image_files::images_in(*it).empty() : image_files::is_image_name(*it))) continue;
    const std::string name = it->path().filename().string();
    const auto number = number_of(name, is_folder);
    if (!number) others.push_back(name);
    if (number && *number >= count) of_no_camera.push_back(name);
  }
  std::ranges::sort(of_no_camera);
  std::ranges::sort(others);
  std::vector<std::string> warnings;
  if (!of_no_camera.empty()) {
    warnings.push_back(fmt::format("{}: {} are masks of no camera, since there are {} (cam0 is the first)",
                                   folder.string(), fmt::join(of_no_camera, ", "), count));
  }
  if (!others.empty()) {
    warnings.push_back(fmt::format("{}: {} not used, since masks are named camN.png or camN/STAMP.png", folder.string(),
                                   fmt::join(others, ", ")));
  }
  return warnings;
}

Result<std::vector<std::string>> add_image_masks(const fs::path& folder, int number, const camera::Camera& camera,
                                                 std::vector<image_files::ImageFile>& images) {
  const fs::path of_camera = folder / name_of(number);
  const std::vector<image_files::NumberedImage> files = image_files::images_in(of_camera);
  std::map<std::int64_t, const fs::path*> masks;
  for (const image_files::NumberedImage& file : files) masks.emplace(file.number, &file.path);
  std::size_t used = 0;
  const fs::path* first = nullptr;
  for (image_files::ImageFile& image : images) {
    auto mask = masks.find(image.time_ns);
    if (const auto named = parse_integer(image.path.stem().string()); mask == masks.end() && named)
      mask = masks.find(*named);
    if (mask == masks.end()) continue;
    image.mask = *mask->second;
    if (used++ == 0) first = mask->second;
  }
  std::error_code error;
  if (used == 0 && (!files.empty() || fs::is_directory(of_camera, error))) {
    return Error{
        of_camera.string(), camera.name,
        files.empty() ? "no masks" : fmt::format("no mask of an image, but {}", files.front().path.filename().string()),
        fmt::format("masks named by the time stamps of the images, such as {}.png", images.front().time_ns)};
  }
  if (first == nullptr) return std::vector<std::string>();
  if (const auto mask = read_image_mask(*first, camera); !mask) return mask.error();
  std::vector<std::string> warnings;
  if (used < masks.size()) {
    warnings.push_back(fmt::format("{}: {} of {} masks belong to no image of {}", of_camera.string(),
                                   masks.size() - used, masks.size(), camera.name));
  }
  return warnings;
}

Result<image::Image> read_image_mask(const fs::path& file, const camera::Camera& camera) {
  auto mask = image_decoding::read_mask_file(file);
  if (!mask || (mask->width() == camera.width && mask->height() == camera.height)) return mask;
  return Error{file.string(), "", fmt::format("{}x{} pixels", mask->width(), mask->height()),
               fmt::format("{}x{}, the resolution of {}", camera.width, camera.height, camera.name)};
}

}  // namespace bslam::dataset
