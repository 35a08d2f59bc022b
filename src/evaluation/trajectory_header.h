// The comments at the top of trajectory files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace bslam::evaluation {

constexpr std::size_t kMaxTrajectoryBytes = std::size_t{1} << 32;  // 40 million poses

// kFinal: poses resolved against the final map; kLive: poses as reported during the run.
enum class PoseState { kFinal, kLive };

// The comment line at the top of trajectories written by a run: "bslam trajectory frame=cam0 parent=world final=true".
std::string trajectory_header(std::string_view frame, PoseState state, std::string_view parent = "world");

// The further comment line of trajectories whose lengths are not metres: "scale=up-to-scale: lengths are not in
// metres".
std::string scale_comment(std::string_view scale);

// The further comment line of trajectories whose times are those that the images were recorded with.
std::string image_stamp_comment();

// The name of the world frame of a submap of a map, with its number in the order of storage::submaps_of: "world" for
// the first one, number 0, and "world_of_submap_1" and so on for the others.
std::string world_of_submap(std::size_t number);

// The content of the comments at the top of a trajectory file of bslam.
struct TrajectoryComments {
  std::string frame;  // frame whose poses the file contains: cam0, body, or the name of a camera; empty if not stated
  bool euroc_csv = false;
  std::string parent = "world";
  PoseState state = PoseState::kFinal;
  std::string scale = "metric";  // or up-to-scale, unobservable
  bool image_stamps = false;     // whether the time offset of the camera is already subtracted from the times

  // The frame of the poses. Those of an EuRoC csv that does not state it are of the body, as in EuRoC's ground truth.
  std::string frame_of_poses() const { return frame.empty() && euroc_csv ? "body" : frame; }
};
// A file that cannot be read has none.
TrajectoryComments read_comments(const std::filesystem::path& file);
// The lines that read_comments() reads, without the first # and the last line break.
std::string text_of(const TrajectoryComments& comments);

}  // namespace bslam::evaluation
