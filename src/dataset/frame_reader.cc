#include "dataset/frame_reader.h"

#include <fmt/format.h>

#include <utility>

#include "base/assert.h"
#include "dataset/mask_folder.h"
#include "image_decoding/image_file.h"

namespace bslam::dataset {

namespace {

Result<image::Image> read_of_camera(const Dataset& dataset, const image_files::ImageFile& file, std::size_t index) {
  const camera::Camera& camera = dataset.rig.camera(index);
  auto image = image_decoding::read_image(file, dataset.pixel_formats.at(index));
  if (!image || (image->width() == camera.width && image->height() == camera.height)) return image;
  return Error{image_files::name_of(file), "", fmt::format("{}x{} pixels", image->width(), image->height()),
               fmt::format("{}x{}, the resolution of {}", camera.width, camera.height, camera.name)};
}

// The mask of an image; empty if it has none.
Result<image::Image> read_mask(const Dataset& dataset, const image_files::ImageFile& file, std::size_t index) {
  if (file.mask.empty()) return image::Image();
  return read_image_mask(file.mask, dataset.rig.camera(index));
}

}  // namespace

std::string describe_damage(const Dataset& dataset, std::size_t index, std::size_t camera) {
  const auto& file = dataset.frames.at(index).images.at(camera);
  if (!file) return "";
  const auto image = read_of_camera(dataset, *file, camera);
  if (const auto mask = read_mask(dataset, *file, camera); image && !mask) return mask.error().message();
  return image ? image_files::name_of(*file) + ": can be read now, although it could not be read before"
               : image.error().message();
}

image::ImageBundle read_frame(const Dataset& dataset, std::size_t index) {
  BSLAM_ASSERT(index < dataset.frames.size(), "the frame index must be within the data set");
  const FrameEntry& frame = dataset.frames[index];
  image::ImageBundle bundle{FrameId(index), frame.time_ns, {}};
  bundle.images.resize(frame.images.size());
  for (std::size_t i = 0; i < frame.images.size(); ++i) {
    if (!frame.images[i]) continue;
    image::CameraImage& out = bundle.images[i];
    out.time_ns = frame.images[i]->time_ns;
    out.state = image::ImageState::kDamaged;
    auto image = read_of_camera(dataset, *frame.images[i], i);
    auto mask = read_mask(dataset, *frame.images[i], i);
    if (!image || !mask) continue;
    if (!dataset.vignettes.empty()) dataset.vignettes[i].correct(*image);
    out.image = *std::move(image);
    out.mask = *std::move(mask);
    out.state = image::ImageState::kPresent;
  }
  return bundle;
}

}  // namespace bslam::dataset
