#include "system/cameras_of_run.h"

#include <algorithm>
#include <utility>

#include "map/rigs_of_map.h"

namespace bslam::system {
namespace {

template <typename T>
void keep(std::vector<T>& values, CamerasOfRun cameras) {
  if (values.size() <= cameras.size) return;
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(cameras.first);
  values = std::vector<T>(begin, begin + static_cast<std::ptrdiff_t>(cameras.size));
}

}  // namespace

bool shared_with_other_rigs(const map::BundledMap& map, const camera::Rig& rig) {
  return map.rig().size() != rig.size() || !map.rig().moves().empty() || !map::find_rig(map, rig);
}

Status check_settings(const Config& config, const map::BundledMap& map, const camera::Rig& rig) {
  if (config.calibration.refine != calibration::Refine::kTrue || !shared_with_other_rigs(map, rig)) return {};
  return Error{"", "calibration.refine", "true in a map of another rig or calibration",
               "auto or false: the calibration of this run is kept as given"};
}

void note_other_rigs(const map::BundledMap& map, const camera::Rig& rig, Config& config) {
  if (shared_with_other_rigs(map, rig)) config = without_calibration(std::move(config));
}

image::ImageBundle widened(const image::ImageBundle& images, CamerasOfRun cameras, std::size_t all) {
  image::ImageBundle out{images.id, images.time_ns, std::vector<image::CameraImage>(all)};
  for (std::size_t c = 0; c < images.images.size(); ++c) {
    const image::CameraImage& from = images.images[c];
    image::CameraImage& to = out.images[cameras.first + c];
    to.state = from.state;
    to.time_ns = from.time_ns;
    to.borrowed = from.view();
    to.borrowed_mask = from.mask_view();
  }
  return out;
}

std::vector<image::Image> widened(std::vector<image::Image> masks, CamerasOfRun cameras, std::size_t all) {
  if (masks.empty() || masks.size() == all) return masks;
  std::vector<image::Image> out(all);
  std::ranges::move(masks, out.begin() + static_cast<std::ptrdiff_t>(cameras.first));
  return out;
}

void narrow(tracking::FrameRecord& record, CamerasOfRun cameras) {
  keep(record.images, cameras);
  keep(record.cameras, cameras);
  narrow(record.result, cameras);
}

void narrow(tracking::TrackResult& result, CamerasOfRun cameras) { keep(result.cameras, cameras); }

void narrow(std::vector<tracking::ObservedKeypoints>& keypoints, CamerasOfRun cameras) { keep(keypoints, cameras); }

}  // namespace bslam::system
