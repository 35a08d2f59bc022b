#include "system/final_poses.h"

#include <algorithm>

namespace bslam::system {
namespace {

using geometry::SE3;
using geometry::Vector6d;
using tracking::FrameRecord;

// Mean twist between the time t of frames[at], `at` being 0 or 1, and t + delay_s, assuming constant acceleration. The
// mean twists of the two intervals between the frames are taken as the twists at the middles of these intervals, and
// are extrapolated linearly to t + delay_s / 2.
std::optional<Vector6d> twist_through(std::span<const FrameRecord, 3> frames, std::size_t at,
                                      const map::BundledMap& map, double delay_s) {
  const double before_s = to_seconds(frames[1].result.time_ns - frames[0].result.time_ns);
  const double after_s = to_seconds(frames[2].result.time_ns - frames[1].result.time_ns);
  const auto near = [](double interval_s) { return interval_s > 0 && interval_s <= tracking::kMaxPrediction_s; };
  if (!near(before_s) || !near(after_s)) return std::nullopt;
  if (frames[1].relocalisation || frames[2].relocalisation) return std::nullopt;  // relocalised: the motion is unknown
  std::optional<SE3> T[3];
  KeyframeId root[3];
  for (std::size_t i = 0; i < 3; ++i) {
    T[i] = T_rig_world_of(frames[i], map);
    if (!T[i]) return std::nullopt;
    root[i] = map.root_of(frames[i].final_result().anchored.reference);
  }
  if (root[0] != root[1] || root[2] != root[1]) return std::nullopt;
  const Vector6d before = (*T[1] * T[0]->inverse()).log() / before_s;
  const Vector6d after = (*T[2] * T[1]->inverse()).log() / after_s;
  const double from_middle_s = delay_s + (at == 0 ? -before_s : before_s);  // twice the time from the first middle
  return before + from_middle_s / (before_s + after_s) * (after - before);
}

// A frame whose pose in the final map is kept: its index among the frames, the pose and the root of its submap.
struct KnownPose {
  std::size_t frame;
  SE3 T_rig_world;
  KeyframeId root;
};

// The keyframes of the final map, and the first frames after changes of the calibration.
std::vector<KnownPose> known_poses(const map::BundledMap& map, KeyframeId first, std::span<const FrameRecord> frames) {
  std::vector<KnownPose> out;
  const std::vector<KeyframeId> root = map.root_of_each();
  for (const KeyframeId k : map.keyframe_ids()) {
    const auto at = find_record(frames, map.keyframe(k).frame->id);
    if (k.index() < first.index() || at == frames.end()) continue;
    out.push_back({static_cast<std::size_t>(at - frames.begin()), map.keyframe(k).T_rig_world, root[k.index()]});
  }
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (!frames[f].recalibrated) continue;
    if (const auto T_rig_world = T_rig_world_of(frames[f], map))
      out.push_back({f, *T_rig_world, root[frames[f].final_result().anchored.reference.index()]});
  }
  std::ranges::stable_sort(out, {}, &KnownPose::frame);  // keyframes first
  const auto same_frame = [](const KnownPose& a, const KnownPose& b) { return a.frame == b.frame; };
  out.erase(std::unique(out.begin(), out.end(), same_frame), out.end());
  return out;
}

// Whether the rig was tracked without interruption from the first to the last of these frames.
bool tracked_throughout(std::span<const FrameRecord> frames) {
  return std::ranges::all_of(frames, [&](const FrameRecord& r) {
    return r.result.status == tracking::TrackStatus::kTracking && (!r.relocalisation || &r == &frames.front());
  });
}

// T_rig_odom of each frame at the scale of `map`. The motion since the frame before was tracked at the scale that the
// map had then.
std::vector<SE3> rescaled_odometry(const map::BundledMap& map, std::span<const FrameRecord> frames) {
  std::vector<SE3> out;
  bool rescaled = false;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const SE3& odometry = frames[f].T_rig_odom;
    const double change = f > 0 ? frames[f].result.anchored.scale_change(map) : 1.0;
    rescaled |= change != 1.0;
    out.push_back(rescaled ? geometry::scaled(odometry * frames[f - 1].T_rig_odom.inverse(), change) * out.back()
                           : odometry);
  }
  return out;
}

}  // namespace

std::vector<std::optional<SE3>> poses_between_keyframes(const map::BundledMap& map, KeyframeId first,
                                                        std::span<const FrameRecord> frames) {
  std::vector<std::optional<SE3>> out;
  for (const FrameRecord& record : frames) out.push_back(T_rig_world_of(record, map));
  const std::vector<KnownPose> known = known_poses(map, first, frames);
  for (std::size_t i = 0; i + 1 < known.size(); ++i) {
    const auto& [begin, T_before, root_before] = known[i];
    const auto& [end, T_after, root_after] = known[i + 1];
    if (root_before != root_after || !tracked_throughout(frames.subspan(begin, end - begin + 1))) continue;
    const double duration_s = to_seconds(frames[end].result.time_ns - frames[begin].result.time_ns);
    if (!(duration_s > 0)) continue;
    const std::vector<SE3> odometry = rescaled_odometry(map, frames.subspan(begin, end - begin + 1));
    for (std::size_t f = begin; f <= end; ++f) {
      const SE3& T_rig_odom = odometry[f - begin];
      const SE3 from_before = T_rig_odom * odometry.front().inverse() * T_before;
      const SE3 from_after = T_rig_odom * odometry.back().inverse() * T_after;
      const double weight = to_seconds(frames[f].result.time_ns - frames[begin].result.time_ns) / duration_s;
      out[f] = SE3::exp(weight * (from_after * from_before.inverse()).log()) * from_before;
    }
  }
  return out;
}

std::optional<SE3> T_rig_world_of(const FrameRecord& record, const map::BundledMap& map) {
  const tracking::TrackResult& r = record.final_result();
  return r.status == tracking::TrackStatus::kTracking ? r.anchored.resolve(map) : std::nullopt;
}

std::vector<std::pair<KeyframeId, Vector6d>> twists_from_neighbours(const map::BundledMap& map, KeyframeId first,
                                                                    std::span<const FrameRecord> frames) {
  std::vector<std::pair<KeyframeId, Vector6d>> out;
  for (const KeyframeId k : map.keyframe_ids()) {
    const frame::BundledFrame& seen = *map.keyframe(k).frame;
    const double delay_s = frame::farthest_delay_s(seen);
    if (k.index() < first.index() || !frame::depends_on_motion(map.rig(), seen)) continue;
    const auto at = find_record(frames, seen.id);
    std::optional<Vector6d> twist;
    if (frames.end() - at >= 2 && at != frames.begin())
      twist = twist_through(std::span<const FrameRecord, 3>(at - 1, 3), 1, map, delay_s);
    if (frames.end() - at >= 3 && !twist)  // the first frame after the start or a loss
      twist = twist_through(std::span<const FrameRecord, 3>(at, 3), 0, map, delay_s);
    if (twist) out.emplace_back(k, *twist);
  }
  return out;
}

}  // namespace bslam::system
