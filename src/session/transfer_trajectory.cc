#include "session/transfer_trajectory.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <unordered_map>
#include <vector>

#include "map/rigs_of_map.h"
#include "session/keyframe_identity.h"
#include "storage/submaps.h"

namespace bslam::session {
namespace {

using evaluation::TimedPose;
using evaluation::Trajectory;
using geometry::SE3;
using storage::Submap;

// A keyframe in both maps.
struct Link {
  TimeNs time_ns = 0;
  std::size_t submap = 0;  // submap of the merged map
  SE3 T_merged_own;        // transform between the two world frames, according to this keyframe
};

// A keyframe at whose time the trajectory has a pose.
struct Sample {
  KeyframeId keyframe;
  TimeNs time_ns = 0;      // in the trajectory
  SE3 T_rig_frame;         // according to the pose of the trajectory and that of the keyframe
  bool at_origin = false;  // the keyframe is the origin of the world frame
};

// The keyframes of a submap whose poses are those of the trajectory.
struct Agreement {
  std::vector<Sample> agreeing;
  std::size_t differing = 0;  // keyframes at times of the trajectory with other poses

  bool better_than(const Agreement& other) const {
    if (agreeing.size() != other.agreeing.size()) return agreeing.size() > other.agreeing.size();
    return differing < other.differing;
  }
};

// The largest difference of a pose of the trajectory from its keyframe.
struct Tolerance {
  double distance = 0, angle_rad = 0;
};

// The final poses of keyframes are those of the map, up to the nine decimals of the file, whose effect increases with
// the distance from the origin, and up to the frames after which a program has saved the map before its trajectory.
// Poses as they were reported during the run differ by the later corrections of the map, usually by a few per cent of
// its size. The poses of another submap differ by an arbitrary transform.
Tolerance tolerance_of(const Submap& submap, const map::BundledMap& map, evaluation::PoseState state) {
  constexpr double kFinal = 1e-3, kLive = 0.05, kRounding = 1e-6;
  const double share = state == evaluation::PoseState::kFinal ? kFinal : kLive;
  Eigen::AlignedBox3d box(geometry::Vector3d::Zero());
  for (const KeyframeId k : submap.keyframes) box.extend(map.keyframe(k).T_rig_world.inverse().translation());
  return {share * box.diagonal().norm() + kRounding, share};
}

bool agree(const SE3& a, const SE3& b, const Tolerance& tolerance) {
  return (a.translation() - b.translation()).norm() <= tolerance.distance &&
         a.rotation().angularDistance(b.rotation()) <= tolerance.angle_rad;
}

// For each camera of the map, the time offset of the first camera of its rig.
std::vector<TimeNs> first_time_offsets(const map::BundledMap& map) {
  std::vector<TimeNs> out;
  for (const std::size_t first : map::first_cameras_of_rigs(map))
    out.push_back(map.given_rig().camera(first).time_offset_ns);
  return out;
}

// Keyframes of the submap at whose times the trajectory has a pose. `subtracted_ns`: for each camera of the map, what
// is subtracted from the capture times of its keyframes.
std::vector<Sample> samples_of(const Submap& submap, const map::BundledMap& map, const Trajectory& trajectory,
                               std::span<const TimeNs> subtracted_ns) {
  constexpr TimeNs kRounding = 1000;
  constexpr double kOrigin = 1e-6;
  std::vector<Sample> out;
  for (const KeyframeId k : submap.keyframes) {
    const frame::BundledFrame& frame = *map.keyframe(k).frame;
    const auto seen = std::ranges::find_if(
        frame.cameras, [](const auto& camera) { return camera.state == image::ImageState::kPresent; });
    if (seen == frame.cameras.end()) continue;
    const TimeNs time_ns = frame.time_ns - subtracted_ns[static_cast<std::size_t>(seen - frame.cameras.begin())];
    const auto pose = std::ranges::lower_bound(trajectory, time_ns - kRounding, {}, &TimedPose::time_ns);
    if (pose == trajectory.end() || pose->time_ns > time_ns + kRounding) continue;
    const SE3& T_rig_world = map.keyframe(k).T_rig_world;
    out.push_back({k, time_ns, T_rig_world * pose->T_world_frame, agree(T_rig_world, SE3(), {kOrigin, kOrigin})});
  }
  return out;
}

// The largest set of keyframes with the same transform from the frame of the trajectory to the rig: the identity for a
// trajectory of a run, and another one for a trajectory that was moved to the body or another camera. One keyframe
// alone means nothing if it gives the transform itself, or if it is the origin, where every run begins, and others
// differ.
Agreement agreement_of(const std::vector<Sample>& samples, const Tolerance& tolerance) {
  constexpr std::size_t kMaxTried = 50;
  Agreement best;
  const auto try_transform = [&](const SE3& T_rig_frame, bool given) {
    Agreement found;
    std::ranges::copy_if(samples, std::back_inserter(found.agreeing),
                         [&](const Sample& s) { return agree(s.T_rig_frame, T_rig_frame, tolerance); });
    found.differing = samples.size() - found.agreeing.size();
    if (found.agreeing.size() == 1 && (!given || (found.agreeing.front().at_origin && found.differing > 0))) return;
    if (found.better_than(best)) best = std::move(found);
  };
  try_transform(SE3(), true);
  for (std::size_t i = 0; i < samples.size(); i += 1 + samples.size() / kMaxTried)
    try_transform(samples[i].T_rig_frame, false);
  return best;
}

// The keyframes of the submap that the trajectory is in, in order of time.
std::vector<Sample> keyframes_of(const std::vector<Submap>& submaps, const map::BundledMap& map,
                                 const Trajectory& trajectory, const evaluation::TrajectoryComments& comments) {
  const std::vector<TimeNs> subtracted_ns =
      comments.image_stamps ? first_time_offsets(map) : std::vector<TimeNs>(map.rig().size());
  Agreement best;
  for (const Submap& submap : submaps) {
    Agreement found =
        agreement_of(samples_of(submap, map, trajectory, subtracted_ns), tolerance_of(submap, map, comments.state));
    if (found.better_than(best)) best = std::move(found);
  }
  return best.agreeing;
}

// Where the keyframes of `merged` are: its keyframe and submap for each identity.
using Places = std::unordered_map<std::uint64_t, std::pair<KeyframeId, std::size_t>>;

Places places_in(const map::BundledMap& merged) {
  Places places;
  const std::vector<Submap> submaps = storage::submaps_of(merged);
  for (std::size_t s = 0; s < submaps.size(); ++s) {
    for (const KeyframeId k : submaps[s].keyframes) places.try_emplace(identity_of(merged.keyframe(k)), k, s);
  }
  return places;
}

std::vector<Link> links_between(const std::vector<Sample>& keyframes, const map::BundledMap& own,
                                const map::BundledMap& merged, const Places& places) {
  std::vector<Link> links;
  for (const Sample& sample : keyframes) {
    const map::BundledKeyframe& keyframe = own.keyframe(sample.keyframe);
    const auto same = places.find(identity_of(keyframe));
    if (same == places.end()) continue;
    const auto [in_merged, submap] = same->second;
    links.push_back({sample.time_ns, submap, merged.keyframe(in_merged).T_rig_world.inverse() * keyframe.T_rig_world});
  }
  return links;
}

// Removes the links that are not in the submap with most of them, and returns that submap.
std::size_t keep_largest_submap(std::vector<Link>& links) {
  std::unordered_map<std::size_t, int> count;
  for (const Link& link : links) ++count[link.submap];
  std::size_t best = links.front().submap;
  for (const Link& link : links) {
    if (count[link.submap] > count[best]) best = link.submap;
  }
  std::erase_if(links, [&](const Link& link) { return link.submap != best; });
  return best;
}

SE3 moved(const TimedPose& pose, const std::vector<Link>& links) {
  const auto after = std::ranges::lower_bound(links, pose.time_ns, {}, &Link::time_ns);
  if (after == links.begin()) return links.front().T_merged_own * pose.T_world_frame;
  if (after == links.end()) return links.back().T_merged_own * pose.T_world_frame;
  const Link &a = *std::prev(after), &b = *after;
  const double fraction = to_seconds(pose.time_ns - a.time_ns) / to_seconds(b.time_ns - a.time_ns);
  return geometry::interpolate(a.T_merged_own * pose.T_world_frame, b.T_merged_own * pose.T_world_frame, fraction);
}

}  // namespace

Result<TransferredTrajectory> transfer_trajectory(const Trajectory& trajectory, const storage::SavedMap& own,
                                                  const storage::SavedMap& merged,
                                                  const evaluation::TrajectoryComments& comments) {
  const Places places = places_in(merged.map);
  const Error apart{merged.file, "keyframes", "none of " + own.file, "a map into which it was merged"};
  if (std::ranges::none_of(own.map.keyframe_ids(),
                           [&](KeyframeId k) { return places.contains(identity_of(own.map.keyframe(k))); }))
    return apart;
  const std::vector<Sample> keyframes = keyframes_of(storage::submaps_of(own.map), own.map, trajectory, comments);
  if (keyframes.empty())
    return Error{own.file, "keyframes", "none with the time and the pose of a pose of the trajectory",
                 "the map that the run of the trajectory has saved"};
  std::vector<Link> links = links_between(keyframes, own.map, merged.map, places);
  if (links.empty()) return apart;
  TransferredTrajectory out;
  out.submap = keep_largest_submap(links);
  out.keyframes = links.size();
  for (const TimedPose& pose : trajectory) out.poses.push_back({pose.time_ns, moved(pose, links)});
  return out;
}

}  // namespace bslam::session
