// A lost rig is relocalised anywhere in the map, also in the map of an earlier run, and not at unknown places.
#include <gtest/gtest.h>

#include "camera/model_parameters.h"
#include "map/rigs_of_map.h"
#include "system/closed_walk.h"

namespace bslam::system {
namespace {

TEST(SystemRelocalisation, RelocalisesAtAKnownPlaceAfterDarkFrames) {
  constexpr std::size_t kDark = 30, kLight = 33;
  Playback walk = play(closed_walk(), {{0, kLight}, {8, 24}});
  for (std::size_t k = kDark; k < kLight; ++k) {
    for (image::CameraImage& i : walk.frames[k].images) blacken(i);
  }
  System system(closed_walk().rig(), small_config(execution::Mode::kSequential), with_vocabulary());
  Config narrow = small_config(execution::Mode::kSequential);  // does not find a place near the last pose either
  narrow.tracking.matching.widest_radius = narrow.tracking.matching.wide_radius;
  System blind(closed_walk().rig(), narrow);
  process_all(system, walk.frames);
  process_all(blind, walk.frames);
  for (const FrameRecord& record : system.frames()) {
    const std::size_t k = record.result.frame.index();
    EXPECT_EQ(is_tracked(record), k < kDark || k >= kLight) << "frame " << k;
    EXPECT_EQ(record.relocalisation.has_value(), k == kLight) << "frame " << k;
    EXPECT_EQ(is_tracked(blind.frames()[k]), k < kDark) << "frame " << k;  // without a vocabulary it is not relocalised
  }
  ASSERT_TRUE(system.frames()[kLight].relocalisation);
  EXPECT_LE(system.keyframe_time(system.frames()[kLight].relocalisation->matched_keyframe), walk.frames[24].time_ns);
  EXPECT_GE(system.frames()[kLight].relocalisation->inliers, 50);
  expect_told_where_it_is(system, walk.truth, walk.truth.front().T_world_frame);
  expect_smooth(system, walk.truth);
  system.finish();
  EXPECT_EQ(system.maps_started(), 1);
  EXPECT_EQ(system.trajectories().size(), 1u);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemRelocalisation, HasNoPoseAtAnUnknownPlace) {
  const Playback walk = play(closed_walk(), {{0, 16}, {36, 46}});
  System system(closed_walk().rig(), small_config(execution::Mode::kSequential), with_vocabulary());
  process_all(system, walk.frames);
  for (const FrameRecord& record : system.frames()) {
    EXPECT_EQ(is_tracked(record), record.result.frame.index() < 16) << "frame " << record.result.frame.value();
    EXPECT_FALSE(record.relocalisation);
  }
  system.finish();
  EXPECT_EQ(system.maps_started(), 1);
}

RenderedTour walk_beside(const camera::Rig& rig) {
  return {rig, 20, [](const auto& building, double duration_s) { return round_and_home(building, duration_s, 0.08); }};
}

// Another trajectory next to the first, in the map of the first.
class SystemSavedMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    System first(closed_walk().rig(), small_config(execution::Mode::kSequential), with_vocabulary());
    process_all(first, closed_walk().frames());
    first.finish();
    saved_ = first.snapshot();
  }
  static void TearDownTestSuite() { saved_.reset(); }

  static Resources resources() {
    Resources out = with_vocabulary();
    out.map = *saved_;
    return out;
  }
  static const RenderedTour& beside() {
    static const RenderedTour walk = walk_beside(closed_walk().rig());
    return walk;
  }
  // Pose of the map's world frame.
  static geometry::SE3 origin() { return closed_walk().truth().front().T_world_frame; }

  static inline map::MapSnapshot saved_;
};

TEST_F(SystemSavedMap, LocaliseOnlyDoesNotChangeIt) {
  for (const execution::Mode mode :
       {execution::Mode::kSequential, execution::Mode::kParallel, execution::Mode::kLagged}) {
    Config config = small_config(mode);
    config.localize_only = true;
    config.looping.recovery.new_submap_after = 1;
    System system(beside().rig(), config, resources());
    process_all(system, beside().frames());
    system.finish();
    EXPECT_EQ(tracked_frames(system), beside().frames().size());
    EXPECT_TRUE(system.frames().front().relocalisation);
    expect_told_where_it_is(system, beside().truth(), origin());
    expect_smooth(system, beside().truth());
    EXPECT_EQ(system.snapshot()->version(), saved_->version());
    EXPECT_TRUE(identical(*system.snapshot(), *saved_));
    EXPECT_EQ(system.maps_started(), 0);
    EXPECT_EQ(final_poses(system).size(), beside().frames().size());
    for (const FrameRecord& record : system.frames()) EXPECT_FALSE(record.keyframe);
  }
}

TEST_F(SystemSavedMap, LocaliseOnlyHasNoPoseAtAnUnknownPlace) {
  System part(closed_walk().rig(), small_config(execution::Mode::kSequential), with_vocabulary());
  process_all(part, play(closed_walk(), {{0, 16}}).frames);
  Config config = small_config(execution::Mode::kSequential);
  config.localize_only = true;
  config.looping.recovery.new_submap_after = 1;
  Resources of_part = with_vocabulary();
  of_part.map = *part.snapshot();
  System system(closed_walk().rig(), config, std::move(of_part));
  process_all(system, play(closed_walk(), {{36, 46}}).frames);
  system.finish();
  EXPECT_EQ(tracked_frames(system), 0u);
  EXPECT_EQ(system.snapshot()->version(), part.snapshot()->version());
}

TEST_F(SystemSavedMap, ARunContinuesInItAndCanBeRepeated) {
  System system(beside().rig(), small_config(execution::Mode::kParallel), resources());
  process_all(system, beside().frames());
  system.finish();
  EXPECT_EQ(tracked_frames(system), beside().frames().size());
  EXPECT_TRUE(system.frames().front().relocalisation);
  expect_told_where_it_is(system, beside().truth(), origin());
  EXPECT_EQ(system.maps_started(), 0);
  EXPECT_GT(system.snapshot()->version(), saved_->version());
  EXPECT_GT(system.snapshot()->newest_keyframe(), saved_->newest_keyframe());
  EXPECT_EQ(system.snapshot()->roots(), saved_->roots());
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);

  auto journal = execution::parse_journal(execution::journal_text(system.journal()), "recorded");
  ASSERT_TRUE(journal.ok());
  Resources again = resources();
  again.replay = std::move(*journal);
  System replayed(beside().rig(), small_config(execution::Mode::kSequential), std::move(again));
  process_all(replayed, beside().frames());
  replayed.finish();
  EXPECT_TRUE(identical(*system.snapshot(), *replayed.snapshot()));
  EXPECT_TRUE(identical(system.live_trajectories(), replayed.live_trajectories()));
}

// ---- Rigs other than the map's

camera::Rig with_focal_length(const camera::Rig& rig, double factor) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    camera::ModelParameters values = camera::parameters(rig.camera(c).model);
    values[0] *= factor;
    values[1] *= factor;
    cameras.back().camera.model = camera::with_parameters(rig.camera(c).model, values);
  }
  return camera::Rig(std::move(cameras));
}

// Three wide-angle cameras at other places of the body that look in other directions; the first one is upside down.
camera::Rig other_robot() {
  geometry::Matrix3d R_body_cam;  // looks ahead: body x forward, y left, z up
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  constexpr double kDegree = std::numbers::pi / 180;
  const auto camera = [&](const char* name, double yaw_deg, double roll_deg, const Eigen::Vector3d& position) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitX()) * R_body_cam;
    const camera::Camera wide{name, camera::KannalaBrandt({190, 190, 179.5, 129.5}, {0.01, 0, 0, 0}), 360, 260, 0, ""};
    return camera::RigCamera{wide, geometry::SE3(R, position)};
  };
  return camera::Rig({camera("a", 15, 180, {0.1, 0.2, 0.1}), camera("b", -15, 0, {0.1, -0.1, -0.05}),
                      camera("c", 100, 0, {-0.1, 0.1, 0.1})});
}

// The pose of camera `c` of `walk` in each frame.
evaluation::Trajectory truth_of(const RenderedTour& walk, std::size_t c) {
  evaluation::Trajectory out = walk.truth();
  for (evaluation::TimedPose& p : out) p.T_world_frame = p.T_world_frame * walk.rig().rig_from_cam(c);
  return out;
}

// The frames with the given cameras only, in this order.
std::vector<image::ImageBundle> frames_of(const RenderedTour& walk, const std::vector<int>& cameras) {
  std::vector<image::ImageBundle> out = walk.frames();
  for (image::ImageBundle& frame : out) {
    std::vector<image::CameraImage> images;
    for (const int c : cameras) images.push_back(frame.images[static_cast<std::size_t>(c)]);
    frame.images = std::move(images);
  }
  return out;
}

// Runs another rig in the saved map, and compares its poses with the truth in the frame of the map.
void expect_located(const camera::Rig& rig, const std::vector<image::ImageBundle>& frames, Resources resources,
                    const evaluation::Trajectory& truth, const geometry::SE3& origin, bool localize_only) {
  const std::size_t cameras_before = resources.map->rig().size();
  const std::size_t keyframes_before = resources.map->keyframe_slots();
  const bool known = map::find_rig(*resources.map, rig).has_value();
  Config config = small_config(execution::Mode::kSequential);
  config.localize_only = localize_only;
  System system(rig, config, std::move(resources));
  process_all(system, frames);
  system.finish();
  EXPECT_GE(tracked_frames(system), frames.size() - 1);
  for (const FrameRecord& record : system.frames()) {
    EXPECT_EQ(record.cameras.size(), rig.size());
    EXPECT_EQ(record.images.size(), rig.size());
    EXPECT_EQ(record.result.cameras.size(), rig.size());
  }
  expect_told_where_it_is(system, truth, origin);
  EXPECT_EQ(system.maps_started(), 0);
  EXPECT_EQ(system.snapshot()->rig().size(), cameras_before + (known ? 0 : rig.size()));
  EXPECT_TRUE(system.rig().same_intrinsics(rig));
  EXPECT_EQ(system.snapshot()->keyframe_slots() > keyframes_before, !localize_only);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

class SystemOtherRig : public SystemSavedMap, public ::testing::WithParamInterface<bool> {};  // whether localize_only

TEST_P(SystemOtherRig, OneOfTheCamerasOfTheMap) {
  const auto& walk = beside();
  expect_located(walk.rig_of(1), frames_of(walk, {0}), resources(), walk.truth(), origin(), GetParam());
}

TEST_P(SystemOtherRig, TheCamerasInAnotherOrder) {
  const auto& walk = beside();
  const std::vector<int> order = {1, 0};
  expect_located(walk.rig().subset(order), frames_of(walk, order), resources(), truth_of(walk, 1), origin(),
                 GetParam());
}

TEST_P(SystemOtherRig, ARigWithOtherLenses) {
  static const RenderedTour walk = walk_beside(with_focal_length(closed_walk().rig(), 1.08));
  expect_located(walk.rig(), walk.frames(), resources(), walk.truth(), origin(), GetParam());
}

TEST_P(SystemOtherRig, AnotherRobot) {
  static const RenderedTour walk = walk_beside(other_robot());
  expect_located(walk.rig(), walk.frames(), resources(), walk.truth(), origin(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(LocaliseOnlyOrContinue, SystemOtherRig, ::testing::Bool());

}  // namespace
}  // namespace bslam::system
