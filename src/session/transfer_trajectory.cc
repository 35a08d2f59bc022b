#include "session/transfer_trajectory.h"

#include <algorithm>
#include <unordered_map>
#include <vector>

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

bool has_pose_at(const Trajectory& trajectory, TimeNs time_ns) {
  constexpr TimeNs kRounding = 1000;
  const auto next = std::ranges::lower_bound(trajectory, time_ns - kRounding, {}, &TimedPose::time_ns);
  return next != trajectory.end() && next->time_ns <= time_ns + kRounding;
}

// The keyframes of a submap in order of time.
const std::vector<KeyframeId>& keyframes_of(const std::vector<Submap>& submaps, const map::BundledMap& map,
                                            const Trajectory& trajectory) {
  return std::ranges::max_element(submaps, {},
                                  [&](const Submap& submap) {
                                    return std::ranges::count_if(submap.keyframes, [&](KeyframeId k) {
                                      return has_pose_at(trajectory, map.keyframe(k).frame->time_ns);
                                    });
                                  })
      ->keyframes;
}

std::vector<Link> links_between(const std::vector<KeyframeId>& keyframes, const map::BundledMap& own,
                                const map::BundledMap& merged) {
  std::unordered_map<std::uint64_t, std::pair<KeyframeId, std::size_t>> found;  // keyframe and submap
  const std::vector<Submap> submaps = storage::submaps_of(merged);
  for (std::size_t s = 0; s < submaps.size(); ++s) {
    for (const KeyframeId k : submaps[s].keyframes) found.try_emplace(identity_of(merged.keyframe(k)), k, s);
  }
  std::vector<Link> links;
  for (const KeyframeId k : keyframes) {
    const auto same = found.find(identity_of(own.keyframe(k)));
    if (same == found.end()) continue;
    const auto [in_merged, submap] = same->second;
    links.push_back({own.keyframe(k).frame->time_ns, submap,
                     merged.keyframe(in_merged).T_rig_world.inverse() * own.keyframe(k).T_rig_world});
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
                                                  const storage::SavedMap& merged) {
  std::vector<Link> links;
  if (const std::vector<Submap> submaps = storage::submaps_of(own.map); !submaps.empty())
    links = links_between(keyframes_of(submaps, own.map, trajectory), own.map, merged.map);
  if (links.empty()) return Error{merged.file, "keyframes", "none of " + own.file, "a map into which it was merged"};
  TransferredTrajectory out;
  out.submap = keep_largest_submap(links);
  out.keyframes = links.size();
  for (const TimedPose& pose : trajectory) out.poses.push_back({pose.time_ns, moved(pose, links)});
  return out;
}

}  // namespace bslam::session
