#include <bslam/map_view.h>

#include <algorithm>
#include <utility>

#include "api/access.h"
#include "api/conversions.h"
#include "api/guard.h"
#include "api/map_view_impl.h"
#include "api/rig_impl.h"
#include "map/rigs_of_map.h"
#include "rig_formats/rig_file.h"
#include "storage/map_file.h"

namespace bslam {
namespace {

// Returns the root of the submap of every keyframe index; -1 if the keyframe was removed.
std::vector<int> submap_by_keyframe(const map::BundledMap& map) {
  std::vector<int> out(map.keyframe_slots(), -1);
  for (const KeyframeId root : map.roots()) {
    for (const KeyframeId k : map.keyframes_of_submap(root)) out[k.index()] = root.value();
  }
  return out;
}

// The camera of the map that is camera 0 of the rig that recorded a keyframe. `first_of_rig`: per camera of the map.
std::size_t camera_0_of(const map::BundledKeyframe& keyframe, const std::vector<std::size_t>& first_of_rig) {
  const auto& cameras = keyframe.frame->cameras;
  const auto used = std::ranges::find_if(cameras, [](const auto& camera) { return !camera.keypoints.empty(); });
  return used == cameras.end() ? 0 : first_of_rig[static_cast<std::size_t>(used - cameras.begin())];
}

}  // namespace

MapView api::make_map_view(map::MapSnapshot map) { return Access::make<MapView>(std::move(map)); }

MapView api::empty_map_view() {
  const camera::Camera camera{"cam0", camera::Pinhole({1, 1, 0, 0}), 1, 1, 0, ""};
  const auto rig = std::make_shared<const camera::Rig>(std::vector<camera::RigCamera>{{camera, geometry::SE3()}});
  return make_map_view(std::make_shared<const map::BundledMap>(rig));
}

MapView::MapView(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Result<MapView> MapView::load(const std::filesystem::path& file) {
  return api::guarded("MapView::load", [&]() -> Result<MapView> {
    auto saved = storage::read_map(file);
    if (!saved) return saved.error();
    return api::make_map_view(std::make_shared<const map::BundledMap>(std::move(saved->map)));
  });
}

int MapView::version() const { return impl_->map->version().value(); }
Scale MapView::scale() const { return api::to_scale(impl_->map->scale()); }
std::size_t MapView::num_keyframes() const { return impl_->map->num_keyframes(); }
std::size_t MapView::num_landmarks() const { return impl_->map->num_landmarks(); }
std::size_t MapView::num_observations() const { return impl_->map->num_observations(); }
Rig MapView::rig() const {
  return api::make_rig(rig_formats::without(impl_->map->rig(), rig_formats::Droppable::kMasks));
}

std::vector<MapView::Keyframe> MapView::keyframes() const {
  const map::BundledMap& map = *impl_->map;
  const std::vector<int> submap = submap_by_keyframe(map);
  const std::vector<std::size_t> first_of_rig = map::first_cameras_of_rigs(map);
  std::vector<Keyframe> out;
  out.reserve(map.num_keyframes());
  for (const KeyframeId k : map.keyframe_ids()) {
    const map::BundledKeyframe& keyframe = map.keyframe(k);
    const std::size_t camera_0 = camera_0_of(keyframe, first_of_rig);
    const geometry::SE3 T_cam0_rig = map.rig().cam_from_rig_at(camera_0, keyframe.frame->time_ns);
    const geometry::SE3 T_world_cam0 = (T_cam0_rig * keyframe.T_rig_world).inverse();
    // The body does not move with a camera that moves on it.
    const geometry::SE3 T_world_body = (map.rig().body_from_rig() * keyframe.T_rig_world).inverse();
    out.push_back({k.value(), keyframe.frame->time_ns, api::to_pose(T_world_cam0), keyframe.parent.value(),
                   submap[k.index()], api::to_pose(T_world_body)});
  }
  return out;
}

std::vector<MapView::Landmark> MapView::landmarks() const {
  const map::BundledMap& map = *impl_->map;
  const std::vector<int> submap = submap_by_keyframe(map);
  std::vector<Landmark> out;
  out.reserve(map.num_landmarks());
  for (const LandmarkId l : map.landmark_ids()) {
    const auto& p = map.landmark(l).position;
    const auto observations = map.observations(l);
    out.push_back({l.value(),
                   {p.x(), p.y(), p.z()},
                   static_cast<int>(observations.size()),
                   submap[observations.front().keyframe.index()]});
  }
  return out;
}

std::vector<std::vector<std::int32_t>> MapView::words() const {
  std::vector<std::vector<std::int32_t>> out;
  for (const KeyframeId k : impl_->map->keyframe_ids()) {
    std::vector<std::int32_t>& words = out.emplace_back();
    for (const frame::CameraFrame& camera : impl_->map->keyframe(k).frame->cameras) {
      for (const WordId word : camera.words) words.push_back(word.value());
    }
    std::ranges::sort(words);
    words.erase(std::unique(words.begin(), words.end()), words.end());
  }
  return out;
}

std::vector<MapView::CovisibilityEdge> MapView::covisibility(int min_landmarks) const {
  const map::BundledMap& map = *impl_->map;
  std::vector<CovisibilityEdge> out;
  for (const KeyframeId k : map.keyframe_ids()) {
    for (const map::Covisible& neighbour : map.keyframe(k).covisible) {
      if (neighbour.keyframe > k && neighbour.weight >= min_landmarks) {
        out.push_back({k.value(), neighbour.keyframe.value(), neighbour.weight});
      }
    }
  }
  return out;
}

std::vector<MapView::Submap> MapView::submaps() const {
  const map::BundledMap& map = *impl_->map;
  std::vector<Submap> out;
  for (const KeyframeId root : map.roots()) out.push_back({root.value(), map.keyframes_of_submap(root).size()});
  return out;
}

}  // namespace bslam
