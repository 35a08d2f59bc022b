#include "session/merge_maps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "evaluation/association.h"
#include "looping/simulated_hall.h"
#include "session/keyframe_identity.h"
#include "session/transfer_trajectory.h"
#include "storage/submaps.h"

namespace bslam::session {
namespace {

using geometry::SE3;
using looping::HallMap;
using storage::SavedMap;

SavedMap saved(const map::BundledMap& map, const std::string& name) {
  auto out = storage::map_from_bytes(storage::map_to_bytes(map, {looping::small_vocabulary()->id(), "0.1.0", name}),
                                     name + ".bmap");
  EXPECT_TRUE(out) << out.error().message();
  return *std::move(out);
}

// Keyframes `from` to `to` of a lap through the hall, in a world frame of its own.
SavedMap part_of_lap(int from, int to, int cameras, const std::string& name) {
  const synthetic::FeatureSimulator simulator = looping::hall(looping::rig_of(cameras));
  const double shift = 0.01 * from + to;
  const geometry::Sim3 world(geometry::Sim3::exp((geometry::Vector7d() << 0.1, 0.2, 0, shift, -3, 1, 0).finished()));
  HallMap out(simulator.rig());
  for (int i = from; i < to; ++i) out.add(simulator.frame(FrameId(i), looping::kStepS * i), world, 0, {}, i == from);
  return saved(out.map, name);
}

std::string bytes_of(const MergeResult& merged) {
  return storage::map_to_bytes(merged.map, {looping::small_vocabulary()->id(), "0.1.0", ""});
}

Result<MergeResult> merged(std::vector<SavedMap> maps) {
  return merge_maps(std::move(maps), looping::small_vocabulary(), {});
}

// Three runs through neighbouring parts of the hall, with different rigs, and one through a part far away.
const std::vector<SavedMap>& runs() {
  static const std::vector<SavedMap> maps = {part_of_lap(0, 12, 2, "a"), part_of_lap(6, 19, 4, "b"),
                                             part_of_lap(13, 24, 2, "c"), part_of_lap(34, 42, 2, "apart")};
  return maps;
}

const MergeResult& merged_runs() {
  static const MergeResult result = merged(runs()).value();
  return result;
}

TEST(MergeMaps, JoinsRunsOfDifferentRigsAndNamesTheOneThatIsApart) {
  const MergeResult& result = merged_runs();
  EXPECT_EQ(result.map.check_invariants(), std::nullopt);
  EXPECT_EQ(result.map.num_keyframes(), 12u + 13 + 11 + 8);
  EXPECT_EQ(result.map.roots().size(), 2u);
  EXPECT_EQ(result.joined, 2);
  ASSERT_EQ(result.inputs.size(), 4u);
  EXPECT_EQ(result.inputs.front().file, "b.bmap");  // it has most keyframes
  for (const MergedInput& input : result.inputs) {
    EXPECT_EQ(input.submap, input.data == "apart" ? 1u : 0u) << input.file;
    EXPECT_EQ(input.reason.empty(), input.data != "apart") << input.file << ": " << input.reason;
  }
}

TEST(MergeMaps, NamesTheLargestMapIfItIsTheOneThatIsApart) {
  const auto result = merged({runs()[0], part_of_lap(6, 14, 4, "d"), part_of_lap(28, 46, 2, "largest")});
  ASSERT_TRUE(result);
  ASSERT_EQ(result->inputs.front().data, "largest");
  EXPECT_EQ(result->inputs[0].submap, 0u);
  EXPECT_FALSE(result->inputs[0].reason.empty());
  for (const std::size_t i : {1, 2}) {
    EXPECT_EQ(result->inputs[i].submap, 1u);
    EXPECT_EQ(result->inputs[i].reason, "");
  }
}

TEST(MergeMaps, DoesNotDependOnTheOrderOfTheMaps) {
  std::vector<SavedMap> maps = runs();
  const std::string expected = bytes_of(merged_runs());
  std::ranges::reverse(maps);
  EXPECT_EQ(bytes_of(merged(maps).value()), expected);
  std::swap(maps[0], maps[2]);
  EXPECT_EQ(bytes_of(merged(maps).value()), expected);
}

// All lengths of a map multiplied.
SavedMap scaled(const SavedMap& original, double factor) {
  map::BundledMap map = original.map;
  for (const KeyframeId root : map.roots()) EXPECT_TRUE(map.scale_submap(root, factor));
  return saved(map, original.info.data);
}

TEST(MergeMaps, SaysWhichMapsDisagreeAboutTheScale) {
  const MergeResult& usual = merged_runs();
  ASSERT_EQ(usual.scales.size(), 2u);  // of a and b, b and c
  for (const ScaleComparison& c : usual.scales) {
    EXPECT_EQ(c.first, 0u);
    EXPECT_NEAR(c.ratio, 1, 0.005);
    EXPECT_FALSE(c.disagrees());
  }
  const auto result = merged({runs()[1], scaled(runs()[0], 1.03)});
  ASSERT_TRUE(result);
  ASSERT_EQ(result->scales.size(), 1u);
  EXPECT_EQ(result->inputs[result->scales[0].second].data, "a");
  EXPECT_NEAR(result->scales[0].ratio, 1.03, 0.005);
  EXPECT_LT(result->scales[0].deviation, 0.01);
  EXPECT_TRUE(result->scales[0].disagrees());
}

TEST(MergeMaps, KeepsTheWarningsOfAllMapsAndScales) {
  EXPECT_TRUE(warnings_of(merged_runs(), &MergedInput::file).empty());
  std::vector<SavedMap> maps = {runs()[0], scaled(runs()[1], 1.03), runs()[2]};
  maps[0].info.warning = "one reason";
  maps[2].info.warning = "another reason";
  const auto result = merged(maps);
  ASSERT_TRUE(result) << result.error().message();
  const std::vector<std::string> warnings = warnings_of(*result, &MergedInput::file);
  ASSERT_EQ(warnings.size(), 4u);
  EXPECT_EQ(warnings[0], "a.bmap: one reason");
  EXPECT_EQ(warnings[1], "c.bmap: another reason");
  for (const std::size_t i : {2, 3}) EXPECT_TRUE(warnings[i].starts_with("the scales of b.bmap and ")) << warnings[i];
  // What is stored names recordings, since files may be temporary, and names them once.
  const std::vector<std::string> stored = warnings_of(*result, &MergedInput::data);
  EXPECT_EQ(stored[0], "a: one reason");
  EXPECT_TRUE(stored[2].starts_with("the scales of b and ")) << stored[2];
  SavedMap site = saved(result->map, "a + c");
  site.info.warning = stored[0] + "; " + stored[1];
  MergeResult again = *result;
  again.scales.clear();
  again.inputs = {{.file = "site.bmap", .data = site.info.data, .warning = site.info.warning}};
  EXPECT_EQ(warnings_of(again, &MergedInput::data), std::vector<std::string>{"a: one reason; c: another reason"});
}

TEST(MergeMaps, RejectsTheSameMapTwice) {
  const auto result = merged({runs()[0], runs()[1], runs()[0]});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().found, "the same map as a.bmap");
}

TEST(MergeMaps, RejectsAMapThatIsPartOfAnother) {
  const auto result = merged({runs()[0], saved(merged_runs().map, "site")});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().file, "a.bmap");
  EXPECT_EQ(result.error().found, "12 of 12 in site.bmap as well");
}

// Twice the same images, as in overlapping parts of a recording: each run refines the keypoints in its own way.
TEST(MergeMaps, TakesKeyframesOfOtherRunsOnTheSameImagesForOthers) {
  const map::BundledMap& map = runs()[0].map;
  const map::BundledKeyframe& keyframe = map.keyframe(map.keyframe_ids().front());
  map::BundledKeyframe moved = keyframe;
  frame::BundledFrame frame = *keyframe.frame;
  std::vector<Eigen::Vector2f> pixels(frame.cameras[0].keypoints.pixel.begin(), frame.cameras[0].keypoints.pixel.end());
  pixels.front().x() += 0.01f;
  frame.cameras[0].keypoints.pixel = std::move(pixels);
  moved.frame = std::make_shared<const frame::BundledFrame>(std::move(frame));
  EXPECT_NE(identity_of(moved), identity_of(keyframe));
  const SavedMap site = saved(merged_runs().map, "site");
  EXPECT_TRUE(std::ranges::any_of(site.map.keyframe_ids(), [&](KeyframeId k) {
    return identity_of(site.map.keyframe(k)) == identity_of(keyframe);
  }));
}

TEST(MergeMaps, RejectsAMapWithoutMetricScale) {
  map::BundledMap map = runs()[0].map;
  map.set_scale(map::Scale::kUpToScale);
  const auto result = merged({saved(map, "mono"), runs()[1]});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().file, "mono.bmap");
  EXPECT_EQ(result.error().key, "scale");
}

// Only one map can do without, since there is nothing to recognise; the result has none either.
TEST(MergeMaps, RejectsAMapWithoutVisualWords) {
  SavedMap without = storage::map_from_bytes(storage::map_to_bytes(runs()[0].map, {}), "wordless.bmap").value();
  const auto result = merged({runs()[1], without});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().file, "wordless.bmap");
  EXPECT_EQ(result.error().key, "vocabulary");
  const auto alone = merged({without});
  ASSERT_TRUE(alone) << alone.error().message();
  EXPECT_EQ(alone->vocabulary, 0u);
  EXPECT_EQ(merged_runs().vocabulary, looping::small_vocabulary()->id());
}

TEST(MergeMaps, EndsAtAnInterruption) {
  std::stop_source source;
  source.request_stop();
  const auto result = merge_maps(runs(), looping::small_vocabulary(), {}, source.get_token());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message(), "interrupted; nothing is written");
}

TEST(TransferTrajectory, FollowsTheKeyframesOfTheRun) {
  const SavedMap site = saved(merged_runs().map, "site"), &own = runs()[0];
  const evaluation::Trajectory keyframes = storage::keyframe_trajectory(own.map, storage::submaps_of(own.map)[0]);
  const auto moved = transfer_trajectory(keyframes, own, site);
  ASSERT_TRUE(moved) << moved.error().message();
  EXPECT_EQ(moved->keyframes, 12u);
  EXPECT_EQ(moved->submap, 0u);
  ASSERT_EQ(moved->poses.size(), keyframes.size());
  const std::vector<KeyframeId> of_site = site.map.keyframe_ids();
  for (const evaluation::TimedPose& pose : moved->poses) {
    EXPECT_TRUE(std::ranges::any_of(of_site, [&](KeyframeId k) {
      return site.map.keyframe(k).frame->time_ns == pose.time_ns &&
             looping::distance_m(site.map.keyframe(k).T_rig_world, pose.T_world_frame.inverse()) < 1e-6;
    }));
  }
}

// Two recordings that begin at the same stamp: the second one was not located in the map of the first and started a
// submap of its own, whose first pose is the origin too.
SavedMap with_overlapping_stamps(TimeNs time_offset_ns = 0) {
  const camera::Rig cameras = looping::rig_of(2);
  std::vector<camera::RigCamera> late;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    late.push_back({cameras.camera(c), cameras.body_from_cam(c)});
    late.back().camera.time_offset_ns = time_offset_ns;
  }
  const camera::Rig rig(late);
  const synthetic::FeatureSimulator simulator = looping::hall(rig);
  HallMap out(rig);
  for (const auto& [first, count] : {std::pair(0, 12), std::pair(30, 5)}) {
    const SE3 T_room_first = simulator.frame(FrameId(first), looping::kStepS * first).T_world_rig;
    const geometry::Sim3 world(T_room_first.inverse());
    for (int i = 0; i < count; ++i) {
      synthetic::SimulatedFrame seen = simulator.frame(FrameId(first + i), looping::kStepS * (first + i));
      seen.frame.time_ns = from_seconds(looping::kStepS * i) + time_offset_ns;
      out.add(seen, world, 0, {}, i == 0);
    }
  }
  return saved(out.map, "two");
}

TEST(TransferTrajectory, UsesTheSubmapThatThePosesAreIn) {
  const SavedMap own = with_overlapping_stamps();
  const std::vector<storage::Submap> submaps = storage::submaps_of(own.map);
  ASSERT_EQ(submaps.size(), 2u);
  const SE3 T_rig_body(geometry::so3_exp(geometry::Vector3d(0.3, -1.2, 0.5)), geometry::Vector3d(0.4, 0.1, -0.3));
  for (std::size_t s = 0; s < submaps.size(); ++s) {
    const evaluation::Trajectory rig = storage::keyframe_trajectory(own.map, submaps[s]);
    for (const evaluation::Trajectory& poses : {rig, evaluation::moved_to_frame(rig, T_rig_body)}) {
      const auto moved = transfer_trajectory(poses, own, own);
      ASSERT_TRUE(moved) << moved.error().message();
      EXPECT_EQ(moved->submap, s);
      EXPECT_EQ(moved->keyframes, submaps[s].keyframes.size());
      for (std::size_t i = 0; i < poses.size(); ++i)
        EXPECT_LT(looping::distance_m(moved->poses[i].T_world_frame, poses[i].T_world_frame), 1e-9);
    }
  }
}

TEST(TransferTrajectory, RefusesPosesOfAnotherRun) {
  const SavedMap own = with_overlapping_stamps();
  evaluation::Trajectory poses = storage::keyframe_trajectory(own.map, storage::submaps_of(own.map)[0]);
  const SE3 elsewhere(geometry::so3_exp(geometry::Vector3d(0.1, 0, 0.2)), geometry::Vector3d(3, 1, 0));
  for (evaluation::TimedPose& pose : poses) pose.T_world_frame = elsewhere * pose.T_world_frame;
  const auto moved = transfer_trajectory(poses, own, own);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().message(),
            "two.bmap: keyframes: found none with the time and the pose of a pose of the trajectory, expected the map "
            "that the run of the trajectory has saved");
}

// The first poses of both runs are the origin.
TEST(TransferTrajectory, RefusesPosesOfAnotherRunThatBeginsAtTheSameTime) {
  const SavedMap own = with_overlapping_stamps();
  evaluation::Trajectory poses = storage::keyframe_trajectory(own.map, storage::submaps_of(own.map)[0]);
  for (evaluation::TimedPose& pose : poses) pose.T_world_frame = geometry::scaled(pose.T_world_frame, 1.2);
  EXPECT_FALSE(transfer_trajectory(poses, own, own));
}

// Poses as they were reported differ from those of the map by its later corrections.
TEST(TransferTrajectory, FindsPosesThatWereReportedDuringTheRun) {
  const SavedMap own = with_overlapping_stamps();
  const storage::Submap second = storage::submaps_of(own.map)[1];
  evaluation::Trajectory poses = storage::keyframe_trajectory(own.map, second);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SE3 drift(geometry::Quaterniond::Identity(), {0.02 * static_cast<double>(i), 0, 0});
    poses[i].T_world_frame = poses[i].T_world_frame * drift;
  }
  evaluation::TrajectoryComments comments;
  comments.state = evaluation::PoseState::kLive;
  const auto moved = transfer_trajectory(poses, own, own, comments);
  ASSERT_TRUE(moved) << moved.error().message();
  EXPECT_EQ(moved->submap, 1u);
  EXPECT_EQ(moved->keyframes, second.keyframes.size());
}

TEST(TransferTrajectory, AddsTheTimeOffsetToTheStampsOfImages) {
  constexpr TimeNs kOffset = 40'000'000;
  const SavedMap own = with_overlapping_stamps(kOffset);
  evaluation::Trajectory poses = storage::keyframe_trajectory(own.map, storage::submaps_of(own.map)[0]);
  for (evaluation::TimedPose& pose : poses) pose.time_ns -= kOffset;
  EXPECT_FALSE(transfer_trajectory(poses, own, own)) << "these are not capture times";
  evaluation::TrajectoryComments comments;
  comments.image_stamps = true;
  const auto moved = transfer_trajectory(poses, own, own, comments);
  ASSERT_TRUE(moved) << moved.error().message();
  EXPECT_EQ(moved->keyframes, 12u);
  EXPECT_EQ(moved->poses.front().time_ns, poses.front().time_ns);
}

TEST(TransferTrajectory, NamesAMapThatDoesNotContainTheRun) {
  const auto moved = transfer_trajectory(evaluation::Trajectory(1), runs()[3], runs()[0]);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().file, "a.bmap");
  EXPECT_EQ(moved.error().found, "none of apart.bmap");
}

}  // namespace
}  // namespace bslam::session
