#include "adjustment/map_adjustment.h"

#include <gtest/gtest.h>

#include "adjustment/robust_cost.h"
#include "map/anchored_pose.h"
#include "mapping/simulated_map.h"

namespace bslam::adjustment {
namespace {

using geometry::SE3;

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.7, .pyramid = {}};

// The images of cameras with an entry in `late_s` are captured that much later than the frame.
map::SimulatedMap true_map(camera::Rig rig, int keyframes, std::vector<double> late_s = {}, bool knows_motion = false) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 500;
  options.sigma_px = kFeatures.sigma_px;
  options.capture_offset_s = std::move(late_s);
  map::SimulatedMap out(synthetic::FeatureSimulator(std::move(rig), synthetic::make_orbit({}), options));
  out.knows_motion = knows_motion;
  for (int i = 0; i < keyframes; ++i) out.add_keyframe(FrameId(i), 0.25 * i);
  return out;
}

// Selects all keyframes, the first `fixed` of them as fixed, and all landmarks.
Selection everything(const map::BundledMap& map, int fixed) {
  Selection s;
  for (const KeyframeId k : map.keyframe_ids()) (k.value() < fixed ? s.fixed_keyframes : s.free_keyframes).push_back(k);
  s.landmarks = map.landmark_ids();
  return s;
}

// Displaces free keyframes by about five centimetres and one degree, landmarks by about half a metre.
void perturb(const Selection& selection, map::BundledMap& map) {
  Random random(5, "perturb");
  const auto noise = [&](double size) -> Eigen::Vector3d {
    return size * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  };
  for (const KeyframeId k : selection.free_keyframes) {
    geometry::Vector6d delta;
    delta << noise(0.01), noise(0.03);
    map.set_pose(k, map.keyframe(k).T_rig_world.perturbed(delta));
  }
  for (const LandmarkId l : selection.landmarks) map.set_position(l, map.landmark(l).position + noise(0.3));
}

double mean_pose_error_m(const map::SimulatedMap& world, const map::BundledMap& map) {
  double sum = 0;
  for (const KeyframeId k : map.keyframe_ids()) sum += map::distance_m(map.keyframe(k).T_rig_world, world.true_pose(k));
  return sum / static_cast<double>(map.num_keyframes());
}

// Over landmarks observed by at least three keyframes.
double median_point_error_m(const map::SimulatedMap& world, const map::BundledMap& map) {
  std::vector<double> errors;
  for (const LandmarkId l : map.landmark_ids()) {
    if (map.observations(l).size() < 3) continue;
    errors.push_back((map.landmark(l).position - world.truth_of(world.truth_of_landmark.at(l.value()))).norm());
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

// Number of features that belong to a landmark.
std::size_t num_features(const map::BundledMap& map) {
  std::size_t sum = 0;
  for (const LandmarkId l : map.landmark_ids()) sum += map.observations(l).size();
  return sum;
}

TEST(AdjustMap, RecoversPerturbedPosesAndPoints) {
  for (const int cameras : {1, 2, 4}) {
    map::SimulatedMap world = true_map(synthetic::ring_rig(cameras), 5);
    const Selection selection = everything(world.map, cameras == 1 ? 2 : 1);
    map::BundledMap start = world.map;
    perturb(selection, start);
    map::MapDraft draft(std::make_shared<const map::BundledMap>(start));
    ASSERT_TRUE(adjust_map(selection, {.robust_iterations = 10, .final_iterations = 10}, kFeatures, draft))
        << cameras << " cameras";
    EXPECT_LT(robust_cost(start, selection, kFeatures, draft.map()), robust_cost(start, selection, kFeatures, start));
    EXPECT_LT(mean_pose_error_m(world, draft.map()), 0.4 * mean_pose_error_m(world, start)) << cameras << " cameras";
    EXPECT_LT(mean_pose_error_m(world, draft.map()), 0.012) << cameras << " cameras";
    EXPECT_LT(median_point_error_m(world, draft.map()), 0.7 * median_point_error_m(world, start))
        << cameras << " cameras";
    // Noise alone takes 5 % of all observations beyond the 95 % bound.
    const std::size_t keypoints = build_problem(start, selection, kFeatures).problem.observations.size();
    EXPECT_LT(static_cast<double>(num_features(start) - num_features(draft.map())),
              0.08 * static_cast<double>(keypoints));
    EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  }
}

// Two of four cameras capture 40 ms late while the rig moves.
double error_of_a_rig_with_late_cameras(bool knows_motion) {
  const map::SimulatedMap world = true_map(synthetic::default_rig(), 8, {0, 0, 0.04, 0.04}, knows_motion);
  const Selection selection = everything(world.map, 2);
  map::BundledMap start = world.map;
  perturb(selection, start);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(start));
  adjust_map(selection, {.robust_iterations = 10, .final_iterations = 10}, kFeatures, draft);
  return mean_pose_error_m(world, draft.map());
}

TEST(AdjustMap, UsesThePosesOfLateCameras) {
  const double known = error_of_a_rig_with_late_cameras(true), unknown = error_of_a_rig_with_late_cameras(false);
  EXPECT_LT(known, 0.004);
  EXPECT_GT(unknown, 3 * known);
}

TEST(AdjustMap, DoesNotChangeFixedOrUnselectedVariables) {
  map::SimulatedMap world = true_map(synthetic::ring_rig(2), 5);
  Selection selection;
  selection.free_keyframes = {KeyframeId(2), KeyframeId(3)};
  selection.fixed_keyframes = {KeyframeId(0), KeyframeId(1)};
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (l.value() % 2 == 0) selection.landmarks.push_back(l);
  }
  map::BundledMap start = world.map;
  perturb(selection, start);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(start));
  ASSERT_TRUE(adjust_map(selection, {}, kFeatures, draft));
  for (const int k : {0, 1, 4}) {
    const SE3 &before = start.keyframe(KeyframeId(k)).T_rig_world,
              &after = draft.map().keyframe(KeyframeId(k)).T_rig_world;
    EXPECT_EQ(before.translation(), after.translation());
    EXPECT_EQ(before.rotation().coeffs(), after.rotation().coeffs());
  }
  for (const int k : {2, 3}) {
    EXPECT_LT(map::distance_m(draft.map().keyframe(KeyframeId(k)).T_rig_world, world.true_pose(KeyframeId(k))),
              map::distance_m(start.keyframe(KeyframeId(k)).T_rig_world, world.true_pose(KeyframeId(k))));
  }
  for (const LandmarkId l : start.landmark_ids()) {
    if (l.value() % 2 == 0) continue;
    EXPECT_EQ(start.observations(l).size(), draft.map().observations(l).size());
    const KeyframeId only = start.observations(l).front().keyframe;
    if (start.observations(l).size() > 1) {
      EXPECT_EQ(start.landmark(l).position, draft.map().landmark(l).position);
    } else {  // observed by one keyframe only: it keeps its position relative to that keyframe
      const Eigen::Vector3d before = start.keyframe(only).T_rig_world * start.landmark(l).position;
      const Eigen::Vector3d after = draft.map().keyframe(only).T_rig_world * draft.map().landmark(l).position;
      EXPECT_LT((before - after).norm(), 1e-9);
    }
  }
}

TEST(AdjustMap, RemovesPlantedOutliers) {
  map::SimulatedMap world = true_map(synthetic::ring_rig(2), 5);
  const KeyframeId last(4);
  std::vector<LandmarkId>
      planted;  // landmarks observed by four keyframes and, wrongly, by an outlier feature of the last one
  const frame::BundledFrame& frame = *world.map.keyframe(last).frame;
  std::vector<FeatureId> free;
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    if (!world.map.landmark_of(last, FeatureId(f)).valid()) free.emplace_back(f);
  }
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (planted.size() == free.size() || planted.size() == 20) break;
    if (world.map.observations(l).size() < 3 || world.map.observations(l).back().keyframe == last) continue;
    ASSERT_TRUE(world.map.add_observation(l, {last, free[planted.size()]}));
    planted.push_back(l);
  }
  ASSERT_GT(planted.size(), 10u);
  map::MapDraft draft = world.draft();
  ASSERT_TRUE(adjust_map(everything(world.map, 1), {}, kFeatures, draft));
  EXPECT_GE(num_features(world.map) - num_features(draft.map()), planted.size());
  std::size_t left = 0;
  for (const LandmarkId l : planted) {
    for (const map::Observation& o : draft.map().observations(l)) left += o.keyframe == last;
  }
  EXPECT_EQ(left, 0u);
  EXPECT_LT(map::distance_m(draft.map().keyframe(last).T_rig_world, world.true_pose(last)), 0.015);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(AdjustMap, DoesNothingWithoutAFixedOrAFreeKeyframe) {
  map::SimulatedMap world = true_map(synthetic::ring_rig(2), 3);
  for (const int fixed : {0, 3}) {
    map::MapDraft draft = world.draft();
    EXPECT_FALSE(adjust_map(everything(world.map, fixed), {}, kFeatures, draft));
    EXPECT_TRUE(std::move(draft).finish().edit.operations.empty());
  }
  Selection nothing = everything(world.map, 1);
  nothing.landmarks.clear();
  map::MapDraft draft = world.draft();
  EXPECT_FALSE(adjust_map(nothing, {}, kFeatures, draft));
}

TEST(AdjustMap, KeepsTheMapValidAfterAStopRequest) {
  map::SimulatedMap world = true_map(synthetic::ring_rig(2), 4);
  std::stop_source stop;
  stop.request_stop();
  map::MapDraft draft = world.draft();
  adjust_map(everything(world.map, 1), {}, kFeatures, draft, stop.get_token());
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  EXPECT_LT(mean_pose_error_m(world, draft.map()), 0.02);
}

TEST(AdjustMap, IsDeterministic) {
  map::SimulatedMap world = true_map(synthetic::ring_rig(3), 4);
  const Selection selection = everything(world.map, 1);
  map::MapDraft a = world.draft(), b = world.draft();
  adjust_map(selection, {}, kFeatures, a);
  adjust_map(selection, {}, kFeatures, b);
  for (const KeyframeId k : world.map.keyframe_ids()) {
    EXPECT_EQ(a.map().keyframe(k).T_rig_world.translation(), b.map().keyframe(k).T_rig_world.translation());
  }
  EXPECT_EQ(a.map().num_observations(), b.map().num_observations());
}

// An adjustment that changes the size of a map of unknown scale records this change, so that frames keep their places
// relative to the keyframes. A map of known scale, or of which two keyframes are fixed, is not rescaled.
TEST(AdjustMap, RecordsChangesOfAScaleThatIsNotKnown) {
  constexpr double kWrong = 1.3;
  const KeyframeId root(0), second(1);
  for (const int fixed : {1, 2}) {
    map::SimulatedMap world = true_map(synthetic::ring_rig(4), 6);
    world.map.set_scale(map::Scale::kUnobservable);
    const double before = map::distance_m(world.map.keyframe(root).T_rig_world, world.map.keyframe(second).T_rig_world);
    const SE3 between = world.map.keyframe(root).T_rig_world.perturbed(
        0.5 * (world.map.keyframe(second).T_rig_world * world.map.keyframe(root).T_rig_world.inverse()).log());
    const auto frame = map::AnchoredPose::at(world.map, root, between);
    ASSERT_TRUE(world.map.scale_submap(root, kWrong));
    map::MapDraft draft = world.draft();
    ASSERT_TRUE(adjust_map(everything(world.map, fixed), {.robust_iterations = 30}, kFeatures, draft));
    const map::BundledMap& adjusted = draft.map();
    const double change = adjusted.keyframe(root).scale;
    if (fixed == 2) {
      EXPECT_EQ(change, kWrong);
      continue;
    }
    // The overlapping cameras know the true scale.
    EXPECT_NEAR(change, 1.0, 0.03);
    for (const KeyframeId k : adjusted.keyframe_ids()) EXPECT_EQ(adjusted.keyframe(k).scale, change);
    const double after = map::distance_m(adjusted.keyframe(root).T_rig_world, adjusted.keyframe(second).T_rig_world);
    EXPECT_NEAR(map::distance_m(*frame.resolve(adjusted), adjusted.keyframe(root).T_rig_world), 0.5 * after,
                0.03 * before);
  }
}

}  // namespace
}  // namespace bslam::adjustment
