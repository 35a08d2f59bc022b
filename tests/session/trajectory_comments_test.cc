#include "session/trajectory_comments.h"

#include <gtest/gtest.h>

namespace bslam::session {
namespace {

using evaluation::PoseState;

RunFrame timed_frame(double time_s, tracking::LostReason reason = tracking::LostReason::kNone) {
  tracking::FrameRecord record;
  const bool tracked = reason == tracking::LostReason::kNone;
  record.result.status = tracked ? tracking::TrackStatus::kTracking : tracking::TrackStatus::kLost;
  record.result.reason = reason;
  return {time_s, record};
}

system::SubmapTrajectory submap(std::size_t poses, bool loaded, int root = 0) {
  return {KeyframeId(root), evaluation::Trajectory(poses), loaded};
}

const std::vector<KeyframeId> kRoots = {KeyframeId(0), KeyframeId(12), KeyframeId(30)};

TEST(TrajectoryComments, ARunWithoutLossesHasItsHeaderOnly) {
  RunRecord record;
  record.frames = {timed_frame(0), timed_frame(0.05)};
  const std::vector<system::SubmapTrajectory> one = {submap(2, false)};
  EXPECT_EQ(trajectory_comments(record, one, 0, PoseState::kFinal, kRoots),
            "bslam trajectory frame=cam0 parent=world final=true");
  EXPECT_EQ(trajectory_comments(record, {}, 0, PoseState::kLive, kRoots),
            "bslam trajectory frame=cam0 parent=world final=false");
}

TEST(TrajectoryComments, NameTheCameraOfTheRunAndAScaleThatIsNotMetric) {
  RunRecord record;
  record.frames = {timed_frame(0)};
  record.cameras_used = {2, 0};
  record.cameras = {{.name = "right", .states = {}}, {.name = "left", .states = {}}};
  record.map.scale = "up-to-scale";
  const std::vector<system::SubmapTrajectory> one = {submap(1, false)};
  EXPECT_EQ(trajectory_comments(record, one, 0, PoseState::kFinal, kRoots),
            "bslam trajectory frame=right parent=world final=true\n# scale=up-to-scale: lengths are not in metres");
  record.cameras.front().name = "right camera";  // frames are single words
  EXPECT_TRUE(
      trajectory_comments(record, one, 0, PoseState::kFinal, kRoots).starts_with("bslam trajectory frame=cam2 "));
  for (const char* reserved : {"body", "cam0", "left_ros"}) {
    record.cameras.front().name = reserved;
    EXPECT_TRUE(
        trajectory_comments(record, one, 0, PoseState::kFinal, kRoots).starts_with("bslam trajectory frame=cam2 "));
  }
  record.cameras_used = {0, 2};
  EXPECT_TRUE(
      trajectory_comments(record, one, 0, PoseState::kFinal, kRoots).starts_with("bslam trajectory frame=cam0 "));
}

TEST(TrajectoryComments, NameSubmapsAndLosses) {
  RunRecord record;
  record.frames = {timed_frame(0), timed_frame(0.05, tracking::LostReason::kFewMatches),
                   timed_frame(0.1, tracking::LostReason::kFewMatches), timed_frame(0.15), timed_frame(0.2)};
  const std::vector<system::SubmapTrajectory> two = {submap(2, false), submap(1, false, 30)};
  EXPECT_EQ(
      trajectory_comments(record, two, 0, PoseState::kFinal, kRoots),
      "bslam trajectory frame=cam0 parent=world final=true\n"
      "# submap 0 of the map, one of 2 with poses, each with its own world frame: 2 of the 5 frames have a pose in it\n"
      "# no pose from 0.050 to 0.100 s after the first image: too few matches");
  EXPECT_TRUE(trajectory_comments(record, two, 1, PoseState::kFinal, kRoots)
                  .starts_with("bslam trajectory frame=cam0 parent=world_of_submap_2 final=true\n"
                               "# submap 2 of the map, one of 2 with poses, "));
}

// The largest submap, that of trajectory.tum, need not be the first one of the map; and one may have been merged.
TEST(TrajectoryComments, NumberSubmapsAsTheMapDoes) {
  RunRecord record;
  record.frames = {timed_frame(0), timed_frame(0.05), timed_frame(0.1)};
  const std::vector<system::SubmapTrajectory> live = {submap(2, false, 12), submap(1, false, 0), submap(1, false, 7)};
  const auto comments = [&](std::size_t index) {
    return trajectory_comments(record, live, index, PoseState::kLive, kRoots);
  };
  EXPECT_TRUE(comments(0).starts_with("bslam trajectory frame=cam0 parent=world_of_submap_1 final=false\n# submap 1 "));
  EXPECT_TRUE(comments(1).starts_with("bslam trajectory frame=cam0 parent=world final=false\n# submap 0 "));
  EXPECT_TRUE(
      comments(2).starts_with("bslam trajectory frame=cam0 parent=world_of_part_3 final=false\n"
                              "# a submap that is not in the map at the end, one of 3 with poses, "));
}

TEST(TrajectoryComments, SayWhetherPosesAreInTheLoadedMap) {
  RunRecord record;
  record.frames = {timed_frame(0)};
  record.map.loaded = true;
  EXPECT_EQ(trajectory_comments(record, std::vector{submap(1, true)}, 0, PoseState::kFinal, kRoots),
            "bslam trajectory frame=cam0 parent=world final=true\n# in the world frame of the loaded map");
  EXPECT_EQ(trajectory_comments(record, std::vector{submap(1, false, 12)}, 0, PoseState::kFinal, kRoots),
            "bslam trajectory frame=cam0 parent=world_of_submap_1 final=true\n"
            "# not in the world frame of the loaded map, but in that of a new submap");
  record.submaps = {{.frames = 7, .trajectory = "a", .loaded = false},
                    {.frames = 3, .trajectory = "b", .loaded = true}};
  EXPECT_EQ(frames_in_loaded_map(record), 3);
}

}  // namespace
}  // namespace bslam::session
