#include "tracking/track.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

struct RigCase {
  const char* name;
  camera::Rig rig;
  double mean_error_m, mean_angle_deg;  // over all frames, per pixel of noise
};

// Squared Mahalanobis distance of the pose from the truth given the noise of its keypoints; six on average if there are
// no other errors.
double squared_normalised_error(const map::BundledMap& map, const frame::BundledFrame& frame,
                                const FrameMatches& matches, const SE3& T_rig_world, const SE3& true_T_rig_world) {
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
  for (const solver::PoseObservation& o : pose_observations(map, frame, matches)) {
    const Eigen::Vector3d p = true_T_rig_world * o.point_world;
    const SE3& T_cam_rig = map.rig().cam_from_rig(o.camera);
    const auto projection = map.rig().camera(o.camera).project_with_jacobian(T_cam_rig * p);
    if (!projection) continue;
    Eigen::Matrix<double, 3, 6> motion;
    motion << 0, p.z(), -p.y(), 1, 0, 0, -p.z(), 0, p.x(), 0, 1, 0, p.y(), -p.x(), 0, 0, 0, 1;
    const Eigen::Matrix<double, 2, 6> J = projection->jacobian * T_cam_rig.matrix3() * motion;
    information += J.transpose() * J / (o.sigma * o.sigma);
  }
  const geometry::Vector6d error = (T_rig_world * true_T_rig_world.inverse()).log();
  return error.dot(information * error);
}

class TrackRigs : public ::testing::TestWithParam<int> {
 protected:
  static RigCase rig_case(int i) {
    switch (i) {
      case 0:
        return {"one camera", synthetic::ring_rig(1), 0.008, 0.12};
      case 1:
        return {"two cameras", synthetic::ring_rig(2), 0.005, 0.08};
      case 2:
        return {"four cameras", synthetic::default_rig(), 0.003, 0.05};
      case 3:
        return {"two fisheyes back to back", synthetic::fisheye_rig(2), 0.005, 0.10};
      default:
        return {"two pinholes, two fisheyes", synthetic::mixed_rig(), 0.004, 0.06};
    }
  }
};

TEST_P(TrackRigs, ErrorsMatchTheNoiseOfTheKeypoints) {
  const RigCase rig = rig_case(GetParam());
  constexpr int kFrames = 20;
  for (const double sigma_px : {0.5, 1.0}) {
    const map::SimulatedMap world = true_map(simulator(rig.rig, room(1, sigma_px, 0.2)), 1.0, 0.25);
    SimulatedTracker tracker(world);
    double error_m = 0, error_rad = 0, normalised = 0;
    for (int i = 1; i <= kFrames; ++i) {
      const auto seen = world.sim.frame(FrameId(i), 0.05 * i);
      const TrackOutput out = tracker.track(seen.frame);
      ASSERT_EQ(out.result.status, TrackStatus::kTracking)
          << rig.name << " frame " << i << ": " << describe(out.result.reason);
      const SE3 truth = seen.T_world_rig.inverse();
      error_m += map::distance_m(out.result.T_rig_world, truth) / kFrames;
      error_rad += map::angle_rad(out.result.T_rig_world, truth) / kFrames;
      const double e = squared_normalised_error(world.map, seen.frame, out.matches, out.result.T_rig_world, truth);
      EXPECT_LT(e, 40.0) << rig.name << " frame " << i;
      normalised += e / kFrames;
    }
    EXPECT_LT(error_m, rig.mean_error_m * sigma_px) << rig.name;
    EXPECT_LT(error_rad, rig.mean_angle_deg * kDegree * sigma_px) << rig.name;
    EXPECT_LT(normalised, 10.0) << rig.name;
  }
}
INSTANTIATE_TEST_SUITE_P(All, TrackRigs, ::testing::Range(0, 5));

class Track : public ::testing::Test {
 protected:
  // Two cameras in front, the first second of the orbit.
  static const map::SimulatedMap& world() {
    static const map::SimulatedMap world = true_map(simulator(synthetic::ring_rig(2)), 1.0, 0.25);
    return world;
  }
  static synthetic::SimulatedFrame seen(int i) { return world().sim.frame(FrameId(i), 0.05 * i); }
  static void expect_true(const TrackResult& result, const SE3& T_world_rig, const char* what) {
    ASSERT_EQ(result.status, TrackStatus::kTracking) << what << ": " << describe(result.reason);
    EXPECT_LT(map::distance_m(result.T_rig_world, T_world_rig.inverse()), 0.012) << what;
    EXPECT_LT(map::angle_rad(result.T_rig_world, T_world_rig.inverse()), 0.2 * kDegree) << what;
  }
};

TEST_F(Track, ToleratesTwentyPercentOutliers) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 12; ++i) {
    auto frame = seen(i);
    displace_keypoints(world().map.rig(), 0.2, Random(7, "displace", static_cast<std::uint64_t>(i)), frame.frame);
    expect_true(tracker.track(frame.frame).result, frame.T_world_rig, "displaced");
  }
}

TEST_F(Track, CountsKeypointsMatchesAndInliersPerCamera) {
  SimulatedTracker tracker(world());
  const auto frame = seen(1);
  const TrackOutput out = tracker.track(frame.frame);
  ASSERT_EQ(out.result.cameras.size(), 2u);
  ASSERT_EQ(out.matches.size(), 2u);
  for (std::size_t c = 0; c < 2; ++c) {
    const CameraCounts& n = out.result.cameras[c];
    EXPECT_EQ(n.keypoints, static_cast<int>(frame.frame.cameras[c].keypoints.size()));
    EXPECT_LE(n.inliers, n.matched);
    EXPECT_GT(n.inliers, 200);
    EXPECT_EQ(n.inliers, static_cast<int>(out.matches[c].size()));
  }
  EXPECT_EQ(out.result.frame, FrameId(1));
  EXPECT_EQ(out.result.time_ns, frame.frame.time_ns);
}

TEST_F(Track, NearlyAllMatchesAreCorrect) {
  SimulatedTracker tracker(world());
  const auto frame = seen(2);
  const TrackOutput out = tracker.track(frame.frame);
  std::size_t wrong = 0;
  for (std::size_t c = 0; c < 2; ++c) {
    std::vector<LandmarkId> once;
    for (const Match& m : out.matches[c]) {
      once.push_back(m.landmark);
      wrong += world().truth_of_landmark.at(m.landmark.value()) != frame.landmark[c][m.keypoint.index()];
    }
    std::sort(once.begin(), once.end());
    EXPECT_EQ(std::adjacent_find(once.begin(), once.end()), once.end());
  }
  EXPECT_LT(wrong, count(out.matches) / 100);
}

TEST_F(Track, StoresThePoseRelativeToItsReference) {
  SimulatedTracker tracker(world());
  const TrackOutput out = tracker.track(seen(3).frame);
  ASSERT_EQ(out.result.status, TrackStatus::kTracking);
  const SE3 again = out.result.anchored.resolve(world().map).value();
  EXPECT_LT(map::distance_m(again, out.result.T_rig_world), 1e-9);
  EXPECT_EQ(out.state.anchored.reference, out.result.anchored.reference);
  EXPECT_EQ(out.state.landmarks, landmarks_of(out.matches));
}

TEST_F(Track, AddsTheErrorOfTheReferenceToTheNoiseOfTheImage) {
  map::BundledMap uncertain = world().map;
  const geometry::Matrix6d of_reference = 1e-4 * geometry::Matrix6d::Identity();
  for (const KeyframeId k : uncertain.keyframe_ids()) uncertain.set_uncertainty(k, {of_reference});
  SimulatedTracker a(world()), b(world());
  const TrackResult exact = a.track(seen(3).frame).result, result = b.track(uncertain, seen(3).frame).result;
  ASSERT_TRUE(exact.covariance && result.covariance);
  const geometry::Matrix6d A = result.anchored.T_rig_reference.adjoint();
  EXPECT_LT((*result.covariance - *exact.covariance - A * of_reference * A.transpose()).norm(), 1e-12);
  EXPECT_EQ(result.T_rig_world.translation(), exact.T_rig_world.translation());
}

TEST_F(Track, FollowsCorrectionsOfTheMap) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 4; ++i) ASSERT_EQ(tracker.track(seen(i).frame).result.status, TrackStatus::kTracking);
  const SE3 T_new_old = SE3::exp((geometry::Vector6d() << 0.2, -0.1, 0.4, 3, -2, 1).finished());
  map::BundledMap moved = world().map;
  for (const KeyframeId k : moved.keyframe_ids())
    moved.set_pose(k, moved.keyframe(k).T_rig_world * T_new_old.inverse());
  for (const LandmarkId l : moved.landmark_ids()) {
    moved.set_position(l, T_new_old * moved.landmark(l).position);
    moved.refresh_landmark(l);
  }
  for (int i = 5; i <= 8; ++i) {
    const auto frame = seen(i);
    expect_true(tracker.track(moved, frame.frame).result, T_new_old * frame.T_world_rig, "after the correction");
  }
}

TEST_F(Track, CountsPredictedAndFoundLandmarks) {
  SimulatedTracker tracker(world());
  const TrackOutput out = tracker.track(seen(1).frame);
  std::size_t found = 0, expected = 0;
  std::vector<LandmarkId> ids;
  for (const map::VisibilityCount& s : out.state.visibility_counts) {
    found += s.found;
    expected += s.expected;
    ids.push_back(s.landmark);
  }
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
  EXPECT_EQ(found, out.state.landmarks.size());
  EXPECT_GT(expected, found);
  EXPECT_GT(static_cast<double>(found), 0.6 * static_cast<double>(expected));  // 85 % are detected in each camera
}

// A rig can stay at a place for hours without a new keyframe.
TEST_F(Track, CountsEachLandmarkOnceHoweverManyFramesSeeIt) {
  SimulatedTracker tracker(world());
  std::map<LandmarkId, std::uint32_t> expected;
  for (int i = 1; i <= 5; ++i) {
    const TrackOutput out = tracker.track(seen(i).frame);
    ASSERT_EQ(out.result.status, TrackStatus::kTracking);
    const std::vector<map::VisibilityCount>& counts = out.state.visibility_counts;
    for (std::size_t k = 1; k < counts.size(); ++k) ASSERT_LT(counts[k - 1].landmark, counts[k].landmark);
    for (const LandmarkId l : out.state.landmarks) ++expected[l];
    for (const map::VisibilityCount& count : counts) {
      EXPECT_EQ(count.found, expected[count.landmark]);
      EXPECT_LE(count.expected, static_cast<std::uint32_t>(i));
      EXPECT_GE(count.expected, count.found);
    }
  }
}

TEST_F(Track, IsLostWithoutFeaturesAndResumes) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 10; ++i) {
    const auto frame = seen(i);
    if (i != 5 && i != 6) {
      expect_true(tracker.track(frame.frame).result, frame.T_world_rig, "in the light");
      continue;
    }
    frame::BundledFrame dark;
    dark.id = frame.frame.id;
    dark.time_ns = frame.frame.time_ns;
    dark.cameras.resize(2);
    for (frame::CameraFrame& c : dark.cameras) c.state = image::ImageState::kPresent;
    const TrackOutput out = tracker.track(dark);
    EXPECT_EQ(out.result.status, TrackStatus::kLost);
    EXPECT_EQ(out.result.reason, LostReason::kFewFeatures);
    EXPECT_EQ(out.state.status, TrackStatus::kLost);
    EXPECT_FALSE(out.keyframe_due);
  }
}

TEST_F(Track, ReportsMissingImages) {
  SimulatedTracker tracker(world());
  const std::vector<int> missing = {0, 1};
  const TrackOutput out = tracker.track(world().sim.frame(FrameId(1), 0.05, missing).frame);
  EXPECT_EQ(out.result.status, TrackStatus::kLost);
  EXPECT_EQ(out.result.reason, LostReason::kNoImages);
}

TEST_F(Track, ContinuesWithTheRemainingCameras) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 9; ++i) {
    const std::vector<int> missing = i < 4 ? std::vector<int>{0} : i < 7 ? std::vector<int>{1} : std::vector<int>{};
    const auto frame = world().sim.frame(FrameId(i), 0.05 * i, missing);
    const TrackOutput out = tracker.track(frame.frame);
    expect_true(out.result, frame.T_world_rig, "with a camera missing");
    for (const int c : missing) EXPECT_EQ(out.result.cameras[static_cast<std::size_t>(c)].inliers, 0);
  }
}

TEST_F(Track, IsLostAtAnUnknownPlace) {
  const synthetic::FeatureSimulator elsewhere = simulator(synthetic::ring_rig(2), room(99));
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 5; ++i) {
    const TrackOutput out = tracker.track(elsewhere.frame(FrameId(i), 0.05 * i).frame);
    EXPECT_EQ(out.result.status, TrackStatus::kLost);
    EXPECT_TRUE(out.result.reason == LostReason::kFewMatches || out.result.reason == LostReason::kFewInliers)
        << describe(out.result.reason);
  }
}

// From half a metre and many degrees away tracking may fail, but it never returns a wrong pose.
TEST_F(Track, IsLostRatherThanWrong) {
  int tracked = 0;
  for (int i = 2; i <= 120; i += 2) {
    SimulatedTracker tracker(world());
    const auto frame = world().sim.frame(FrameId(i), 0.1 * i);
    auto shown = frame.frame;
    shown.time_ns = from_seconds(0.05);
    for (frame::CameraFrame& c : shown.cameras) c.time_ns = shown.time_ns;
    const TrackOutput out = tracker.track(shown);
    if (out.result.status != TrackStatus::kTracking) continue;
    ++tracked;
    EXPECT_LT(map::distance_m(out.result.T_rig_world, frame.T_world_rig.inverse()), 0.05) << "from " << 0.1 * i << " s";
  }
  EXPECT_GT(tracked, 0);
}

TEST_F(Track, SearchesInWideWindowsIfThePredictionIsWrong) {
  SimulatedTracker tracker(world());
  tracker.state.twist =
      (geometry::Vector6d() << 0.0, 1.2, 0.4, 0.5, 0, 0).finished();  // 3.6 degrees, 2.5 cm in a frame
  const auto frame = seen(1);
  expect_true(tracker.track(frame.frame).result, frame.T_world_rig, "wrong prediction");
}

// Where the rig has turned so far that the next frame would be lost, a frame after a pause is not.
TEST_F(Track, SearchesTheFurtherTheLongerThePauseWas) {
  const auto after = [&](double pause_s, const synthetic::SimulatedFrame& frame) {
    auto shown = frame.frame;
    shown.time_ns = from_seconds(pause_s);
    for (frame::CameraFrame& c : shown.cameras) c.time_ns = shown.time_ns;
    return SimulatedTracker(world()).track(shown).result;
  };
  int i = 1;
  while (i < 60 && after(0.05, seen(i)).status == TrackStatus::kTracking) ++i;
  ASSERT_LT(i, 60);
  EXPECT_GT(map::angle_rad(seen(i).T_world_rig, world().frames[0].T_world_rig), MatchingOptions{}.wide_radius);
  expect_true(after(0.5, seen(i)), seen(i).T_world_rig, "after a pause");
}

// The motion is unknown in the first frame after the initialisation and after a long pause. Two of five keypoints are
// at their previous position, as with a repetitive pattern: narrow windows around the old pose would contain only
// these.
TEST_F(Track, DoesNotLockOntoStationaryMatchesIfTheMotionIsUnknown) {
  SimulatedTracker tracker(world()), paused(world());
  paused.state.twist.emplace(geometry::Vector6d::Zero());
  paused.state.time_ns -= from_seconds(1.0);
  const auto frame = world().sim.frame(FrameId(6), 0.3);
  auto shown = frame.frame;
  const auto& before = world().frames[0];
  for (std::size_t c = 0; c < shown.cameras.size(); ++c) {
    feature::Refinement k = shown.cameras[c].keypoints.positions();
    const feature::Keypoints& old = before.frame.cameras[c].keypoints;
    for (std::size_t i = 0; i < k.pixel.size(); ++i) {
      const auto same = std::ranges::find(before.landmark[c], frame.landmark[c][i]);
      if (i % 5 > 1 || frame.landmark[c][i] < 0 || same == before.landmark[c].end()) continue;
      const auto o = static_cast<std::size_t>(same - before.landmark[c].begin());
      k.pixel[i] = old.pixel[o];
      k.bearing[i] = old.bearing[o];
    }
    shown.cameras[c] = frame::refined(shown.cameras[c], std::move(k), world().map.rig().camera(c));
  }
  EXPECT_GT(map::angle_rad(frame.T_world_rig, before.T_world_rig), 2 * tracker.options.matching.predicted_radius);
  expect_true(tracker.track(shown).result, frame.T_world_rig, "first motion");
  expect_true(paused.track(shown).result, frame.T_world_rig, "motion after a pause");
}

TEST_F(Track, EstimatesTheMotion) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 6; ++i) tracker.track(seen(i).frame);
  ASSERT_TRUE(tracker.state.twist.has_value());
  const SE3 now = seen(6).T_world_rig.inverse(), next = seen(7).T_world_rig.inverse();
  const SE3 predicted = SE3::exp(0.05 * *tracker.state.twist) * now;
  EXPECT_LT(map::distance_m(predicted, next), 0.02);
  EXPECT_LT(map::angle_rad(predicted, next), 0.4 * kDegree);
}

// Cameras that capture late would be displaced by noise divided by a millisecond.
TEST_F(Track, KeepsTheMotionForAFrameThatFollowsImmediately) {
  SimulatedTracker tracker(world());
  for (int i = 1; i <= 6; ++i) tracker.track(seen(i).frame);
  const geometry::Vector6d before = tracker.state.twist.value();
  const TrackOutput out = tracker.track(world().sim.frame(FrameId(7), 0.301).frame);
  ASSERT_EQ(out.result.status, TrackStatus::kTracking);
  EXPECT_EQ(out.frame.twist, before);
}

TEST_F(Track, DoesNotDependOnTheNumberOfThreads) {
  const auto pyramids = map::flat_pyramids(2);
  const std::vector<matching::AlignmentOptions> alignment(pyramids.size());
  std::vector<SE3> poses;
  for (const int threads : {1, 2, 3}) {
    ThreadPool pool(threads);
    frame::BundledFrame frame = seen(2).frame;
    const TrackerState state = state_at_first(world());
    poses.push_back(
        track({.map = world().map, .pyramids = pyramids, .alignment = alignment, .state = state}, frame, {}, pool)
            .result.T_rig_world);
  }
  for (const SE3& T : poses) {
    EXPECT_EQ(T.translation(), poses[0].translation());
    EXPECT_EQ(T.rotation().coeffs(), poses[0].rotation().coeffs());
  }
}

TEST(TrackerState, IsResetAtAKeyframe) {
  TrackerState before;
  before.status = TrackStatus::kTracking;
  before.twist = geometry::Vector6d::Ones().eval();
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 0.0, 1.0);
  const KeyframeId keyframe(0);
  before.references.assign(world.map.rig().size(), {KeyframeId(9), 7, 300, 200});
  before.visibility_counts = {{LandmarkId(1), 1, 1}};
  const TrackerState state = state_at_keyframe(before, 50, world.map, keyframe, {LandmarkId(2), LandmarkId(3)});
  EXPECT_EQ(state.anchored.reference, keyframe);
  EXPECT_EQ(state.time_ns, 50);
  for (const CameraReference& r : state.references) {
    EXPECT_EQ(r.keyframe, keyframe);
    EXPECT_EQ(r.frames, 0);
    EXPECT_EQ(r.best_overlap, 0);
    EXPECT_EQ(r.best_direct_overlap, 0);
  }
  EXPECT_TRUE(state.visibility_counts.empty());
  EXPECT_EQ(state.anchored.T_rig_reference.translation().norm(), 0.0);
  EXPECT_TRUE(state.twist.has_value());
  EXPECT_EQ(state.landmarks.size(), 2u);
}

TEST(LostReason, EachHasADistinctDescription) {
  std::vector<std::string_view> words;
  for (int i = 1; i <= static_cast<int>(LostReason::kNotFound); ++i)
    words.push_back(describe(static_cast<LostReason>(i)));
  for (std::size_t i = 0; i < words.size(); ++i) {
    EXPECT_FALSE(words[i].empty());
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(words[i], words[j]);
  }
  EXPECT_TRUE(describe(LostReason::kNone).empty());
}

// Mean position error over frames in which the rig rotates and the side cameras capture late.
double mean_error_with_late_side_cameras(bool use_capture_times) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 2.0, 0.25);
  synthetic::FeatureSimulatorOptions late = room();
  late.capture_offset_s = {0, 0, 0.03, 0.03};
  const auto sim = simulator(synthetic::default_rig(), late);
  SimulatedTracker tracker(world);
  double error = 0;
  constexpr int kFrames = 30;
  for (int i = 1; i <= kFrames; ++i) {
    auto seen = sim.frame(FrameId(i), 0.05 * i);
    for (frame::CameraFrame& c : seen.frame.cameras) c.time_ns = use_capture_times ? c.time_ns : seen.frame.time_ns;
    const TrackOutput out = tracker.track(seen.frame);
    EXPECT_EQ(out.result.status, TrackStatus::kTracking) << i;
    error += map::distance_m(out.result.T_rig_world, seen.T_world_rig.inverse()) / kFrames;
  }
  return error;
}

TEST(TrackOneByOne, CamerasThatCaptureLateImproveThePoseIfTheirTimesAreUsed) {
  const double own = mean_error_with_late_side_cameras(true);
  EXPECT_LT(own, 0.006);
  EXPECT_GT(mean_error_with_late_side_cameras(false), 2 * own);
}

}  // namespace
}  // namespace bslam::tracking
