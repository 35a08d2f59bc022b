#include "session/trajectory_comments.h"

#include <fmt/format.h>

#include <algorithm>

namespace bslam::session {
namespace {

// Frames whose names mean something else: the body, camera 0 of the rig, and axes as in ROS.
bool is_reserved(const std::string& name) { return name == "body" || name == "cam0" || name.ends_with("_ros"); }

// The frame of the poses: that of the first camera of the run, which is cam0 if it is the first camera of the rig.
// Cameras whose names cannot be used are called by their numbers.
std::string frame_name(const RunRecord& record) {
  if (record.cameras_used.empty() || record.cameras_used.front() == 0 || record.cameras.empty()) return "cam0";
  const std::string& name = record.cameras.front().name;
  const bool is_word = !name.empty() && name.find_first_of(" \t\r\n:") == std::string::npos;
  return is_word && !is_reserved(name) ? name : "cam" + std::to_string(record.cameras_used.front());
}

// The world frame of the poses. A submap that is not in the map has that of the file with this index.
std::string world_name(std::optional<std::size_t> number, std::size_t index) {
  return number ? evaluation::world_of_submap(*number) : fmt::format("world_of_part_{}", index + 1);
}

}  // namespace

std::optional<std::size_t> submap_number(KeyframeId root, std::span<const KeyframeId> roots) {
  const auto at = std::ranges::find(roots, root);
  if (at == roots.end()) return std::nullopt;
  return static_cast<std::size_t>(at - roots.begin());
}

std::string trajectory_comments(const RunRecord& record, std::span<const system::SubmapTrajectory> submaps,
                                std::size_t index, evaluation::PoseState state, std::span<const KeyframeId> roots) {
  const bool has_poses = index < submaps.size();
  const std::optional<std::size_t> number =
      has_poses ? submap_number(submaps[index].root, roots) : std::optional<std::size_t>(0);
  std::string text = evaluation::trajectory_header(frame_name(record), state, world_name(number, index));
  if (record.map.scale != "metric") text += "\n# " + evaluation::scale_comment(record.map.scale);
  if (submaps.size() > 1) {
    text += fmt::format(
        "\n# {}, one of {} with poses, each with its own world frame: {} of the {} frames have a pose in it",
        number ? fmt::format("submap {} of the map", *number) : "a submap that is not in the map at the end",
        submaps.size(), submaps[index].poses.size(), record.frames.size());
  }
  if (has_poses && record.map.loaded) {
    text += submaps[index].loaded ? "\n# in the world frame of the loaded map"
                                  : "\n# not in the world frame of the loaded map, but in that of a new submap";
  }
  for (const LostInterval& interval : lost_intervals(record)) {
    text += fmt::format("\n# no pose from {:.3f} to {:.3f} s after the first image: {}", interval.from_s, interval.to_s,
                        interval.reason);
  }
  return text;
}

}  // namespace bslam::session
