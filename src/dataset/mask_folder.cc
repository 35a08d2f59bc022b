#include "dataset/mask_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <system_error>
#include <utility>

#include "base/number_text.h"
#include "image_decoding/image_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

std::string name_of(int camera) { return fmt::format("cam{}", camera); }

}  // namespace

Result<camera::Rig> with_masks(const camera::Rig& rig, const std::vector<int>& cameras, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return Error{folder.string(), "--masks", "no such folder", "a folder with masks camN.png or camN/STAMP.png"};
  std::vector<camera::RigCamera> masked;
  bool any = false;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    camera::Camera camera = rig.camera(i);
    const fs::path file = folder / (name_of(cameras[i]) + ".png");
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

std::vector<std::string> masks_of_no_camera(const fs::path& folder, std::size_t count) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string stem = it->path().stem().string(), extension = it->path().extension().string();
    if (!stem.starts_with("cam") || !(extension.empty() || extension == ".png")) continue;
    const auto number = parse_integer(stem.substr(3));
    if (number && (*number < 0 || static_cast<std::uint64_t>(*number) >= count))
      names.push_back(it->path().filename().string());
  }
  if (names.empty()) return {};
  std::ranges::sort(names);
  return {fmt::format("{}: {} are masks of no camera, since there are {} (cam0 is the first)", folder.string(),
                      fmt::join(names, ", "), count)};
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
  auto mask = image_decoding::read_image(file);
  if (!mask || (mask->width() == camera.width && mask->height() == camera.height)) return mask;
  return Error{file.string(), "", fmt::format("{}x{} pixels", mask->width(), mask->height()),
               fmt::format("{}x{}, the resolution of {}", camera.width, camera.height, camera.name)};
}

}  // namespace bslam::dataset
