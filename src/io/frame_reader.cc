#include "io/frame_reader.h"

#include <utility>

#include "base/assert.h"
#include "io/image_file.h"

namespace bslam::io {

image::ImageBundle read_frame(const Dataset& dataset, std::size_t index) {
  BSLAM_ASSERT(index < dataset.frames.size(), "a frame of the data set");
  const FrameEntry& frame = dataset.frames[index];
  image::ImageBundle bundle{FrameId(index), frame.time_ns, {}};
  bundle.images.resize(frame.images.size());
  for (std::size_t i = 0; i < frame.images.size(); ++i) {
    if (!frame.images[i]) continue;
    image::CameraImage& out = bundle.images[i];
    out.time_ns = frame.images[i]->time_ns;
    out.state = image::ImageState::kDamaged;
    auto image = read_image(frame.images[i]->path);
    const camera::Camera& camera = dataset.rig.camera(i);
    if (!image || image->width() != camera.width || image->height() != camera.height) continue;
    out.image = *std::move(image);
    out.state = image::ImageState::kPresent;
  }
  return bundle;
}

}  // namespace bslam::io
