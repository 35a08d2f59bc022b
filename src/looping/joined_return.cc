#include "looping/joined_return.h"

#include <algorithm>

#include "looping/place_recogniser.h"
#include "map/scene_depth.h"

namespace bslam::looping {
namespace {

// Minimum number of successive keyframes that do not see a place, after which seeing it again is a return.
constexpr int kAway = 10;
// A place is in sight of a keyframe that shares at least this fraction of the landmarks that the returning keyframe
// shares with it. In a wide room, cameras all around observe some of a place from everywhere.
constexpr double kInSight = 0.25;

double distance(const map::BundledMap& map, KeyframeId a, KeyframeId b) {
  const auto centre = [&](KeyframeId k) -> Eigen::Vector3d {
    return map.keyframe(k).T_rig_world.inverse().translation();
  };
  return (centre(a) - centre(b)).norm();
}

// Whether there are kAway successive keyframes between the two that do not see the place of the earlier one. The later
// one shares `weight` landmarks with the earlier one.
bool was_away(const map::BundledMap& map, KeyframeId earlier, KeyframeId later, int weight,
              const RecognitionOptions& options) {
  auto neighbours = neighbours_of(map, earlier, options);
  std::erase_if(neighbours, [&](const map::Covisible& c) { return c.weight < kInSight * weight; });
  const std::vector<KeyframeId> root = map.root_of_each();
  int away = 0;
  for (std::size_t i = earlier.index() + 1; i < later.index() && away < kAway; ++i) {
    const KeyframeId k(i);
    if (!map.alive(k) || root[i] != root[earlier.index()]) continue;
    away = std::ranges::binary_search(neighbours, k, {}, &map::Covisible::keyframe) ? 0 : away + 1;
  }
  return away == kAway;
}

}  // namespace

std::optional<KeyframeId> JoinedReturns::find(const map::BundledMap& map, KeyframeId keyframe,
                                              const LoopingOptions& options) {
  std::optional<KeyframeId> closest;
  double least = options.loop.max_distance_over_depth * map::median_depth(map, keyframe);
  for (const map::Covisible& c : neighbours_of(map, keyframe, options.recognition)) {
    if (c.keyframe > keyframe) continue;
    const double d = distance(map, c.keyframe, keyframe);
    if (d > least || !was_away(map, c.keyframe, keyframe, c.weight, options.recognition)) continue;
    least = d;
    closest = c.keyframe;
  }
  const bool goes_on = last_.valid() && keyframe.value() - last_.value() <= options.loop.max_keyframe_gap;
  if (closest && goes_on) last_ = keyframe;
  return goes_on ? std::nullopt : closest;
}

}  // namespace bslam::looping
