#include "calibration/moved_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/work.h"
#include "calibration/adjusted_map.h"
#include "calibration/move_search.h"
#include "mapping/simulated_map.h"

namespace bslam::calibration::moves {
namespace {

using geometry::SE3;

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.5, .pyramid = {}};
constexpr double kDegree = std::numbers::pi / 180;
const CalibrationOptions kIndependent{.correlated_observations = 1};
constexpr int kKeyframes = 30;
constexpr double kStep_s = 0.3;

struct Moved {
  std::size_t camera;
  int keyframe;  // the first one after the move
  SE3 T_after_initial;
};

SE3 turn(const Eigen::Vector3d& degrees, const Eigen::Vector3d& metres = Eigen::Vector3d::Zero()) {
  return SE3(geometry::so3_exp(kDegree * degrees), metres);
}

camera::Rig with_extrinsics(const camera::Rig& rig, const Moved& moved) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    if (c == moved.camera)
      cameras.back().T_body_cam = rig.body_from_rig() * (moved.T_after_initial * rig.cam_from_rig(c)).inverse();
  }
  return camera::Rig(std::move(cameras));
}

// The rig after moves of cameras, but not of camera 0, at keyframe i. The last one of a camera counts.
camera::Rig rig_at(const camera::Rig& rig, std::span<const Moved> moves, int i) {
  camera::Rig now = rig;
  for (Moved moved : moves) {
    if (i < moved.keyframe) continue;
    moved.T_after_initial = moved.T_after_initial * rig.cam_from_rig(moved.camera) * now.rig_from_cam(moved.camera);
    now = with_extrinsics(now, moved);
  }
  return now;
}

// A map of a rig of which cameras were moved, adjusted as if they had not been. `order`: of the creation of keyframes.
map::BundledMap map_of(const camera::Rig& rig, std::span<const Moved> moves, std::span<const int> order = {}) {
  map::SimulatedMap out(map::orbit_simulator(rig, kFeatures));
  for (int n = 0; n < kKeyframes; ++n) {
    const int i = order.empty() ? n : order[static_cast<std::size_t>(n)];
    out.sim = map::orbit_simulator(rig_at(rig, moves, i), kFeatures);
    out.add_keyframe(FrameId(i), kStep_s * i);
  }
  return map::adjusted(out, kFeatures);
}
map::BundledMap map_of(const camera::Rig& rig, const Moved& moved) { return map_of(rig, std::span(&moved, 1)); }

RigRefinement refined(const map::BundledMap& map) { return refine_rig(map, map.rig(), kIndependent, kFeatures); }

TimeNs time_of(const map::BundledMap& map, int keyframe) { return map.keyframe(KeyframeId(keyframe)).frame->time_ns; }

// How far the image of a distant point on the optical axis of a camera moves. A turn of the camera and a shift of its
// principal point, which the images hardly distinguish, cancel each other.
double shift_of_image_px(const camera::Rig& truth, const camera::Rig& estimate, std::size_t c) {
  constexpr double kFar_m = 1000;
  const Eigen::Vector3d axis = truth.rig_from_cam(c).rotation() * Eigen::Vector3d(0, 0, kFar_m);
  const auto before = truth.camera(c).project(truth.cam_from_rig(c) * axis),
             after = estimate.camera(c).project(estimate.cam_from_rig(c) * axis);
  return before && after ? (*after - *before).norm() : std::numeric_limits<double>::infinity();
}

TEST(MovedCamera, IsFoundWithTheTimeAndTheChangeOfItsExtrinsics) {
  const camera::Rig rig = synthetic::default_rig();
  for (const Moved& moved :
       {Moved{1, 12, turn({0.1, -0.3, 0.1})}, Moved{1, 20, turn({0, 0.5, 0.2}, {0.004, 0, 0.002})}}) {
    const map::BundledMap map = map_of(rig, moved);
    const RigRefinement result = refined(map);
    ASSERT_TRUE(result.done);
    EXPECT_EQ(result.verdict, Verdict::kInconsistent);
    ASSERT_EQ(result.moves.size(), 1u);
    EXPECT_EQ(result.moves[0].camera, moved.camera);
    EXPECT_EQ(result.moves[0].time_ns, time_of(map, moved.keyframe));
    const double change_deg = geometry::degrees(geometry::so3_log(moved.T_after_initial.rotation()).norm());
    EXPECT_NEAR(result.moves[0].change_deg, change_deg, 0.03);
    EXPECT_LT(result.moves[0].std_deg, 0.02);
    ASSERT_EQ(result.rig->moves().size(), 1u);
    EXPECT_LT(map::angle_rad(result.rig->moves()[0].T_after_initial, moved.T_after_initial), 0.03 * kDegree);
    // The camera itself has the extrinsics before the move.
    EXPECT_LT(shift_of_image_px(rig, *result.rig, moved.camera), 0.25);
    EXPECT_LT(map::angle_rad(result.rig->cam_from_rig(moved.camera), rig.cam_from_rig(moved.camera)),
              3 * kDegree * result.cameras[moved.camera].std_deg);
  }
}

// With the moves that are known, no others are found, and the estimate stays as it is.
TEST(MovedCamera, StaysAsItWasFound) {
  const Moved moved{1, 12, turn({0, 0.4, 0})};
  const map::BundledMap map = map_of(synthetic::default_rig(), moved);
  const RigRefinement first = refined(map);
  ASSERT_EQ(first.moves.size(), 1u);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(map));
  apply(first, draft);
  ASSERT_EQ(draft.map().rig().moves().size(), 1u);
  const RigRefinement second = refine_rig(draft.map(), map.rig(), kIndependent, kFeatures);
  ASSERT_EQ(second.moves.size(), 1u);
  EXPECT_EQ(second.moves[0].time_ns, first.moves[0].time_ns);
  EXPECT_NEAR(second.moves[0].change_deg, first.moves[0].change_deg, 0.01);
  for (std::size_t c = 1; c < map.rig().size(); ++c)
    EXPECT_LT(map::angle_rad(second.rig->cam_from_rig(c), first.rig->cam_from_rig(c)), 0.02 * kDegree) << c;
}

// Threads may create keyframes later than others that were captured after them. The keyframes of a loaded map have
// times of their own, though.
TEST(MovedCamera, IsFoundIfKeyframesAreNotInOrderOfTime) {
  const camera::Rig rig = synthetic::default_rig();
  const Moved moved{1, 12, turn({0, 0.4, 0})};
  std::vector<int> order(kKeyframes);
  for (int n = 0; n < kKeyframes; ++n) order[static_cast<std::size_t>(n)] = (n + kKeyframes / 2) % kKeyframes;
  const map::BundledMap map = map_of(rig, std::span(&moved, 1), order);
  const RigRefinement result = refined(map);
  ASSERT_EQ(result.moves.size(), 1u);
  EXPECT_NEAR(to_seconds(result.moves[0].time_ns), kStep_s * moved.keyframe, 1e-6);
  EXPECT_NEAR(result.moves[0].change_deg, 0.4, 0.03);
  const KeyframeId first(kKeyframes / 2);
  EXPECT_TRUE(refine_rig(map, map.rig(), kIndependent, kFeatures, {}, first).moves.empty());
}

TEST(MovedCamera, MayMoveTwiceAndOthersAsWell) {
  const camera::Rig rig = synthetic::default_rig();
  const std::vector<Moved> moves = {
      {1, 8, turn({0, 0.4, 0})}, {3, 14, turn({0.3, 0, 0.2})}, {1, 21, turn({0.4, 0.4, 0})}};
  const map::BundledMap map = map_of(rig, moves);
  const RigRefinement result = refined(map);
  ASSERT_EQ(result.moves.size(), moves.size());
  for (std::size_t m = 0; m < moves.size(); ++m) {
    EXPECT_EQ(result.moves[m].camera, moves[m].camera);
    EXPECT_EQ(result.moves[m].time_ns, time_of(map, moves[m].keyframe)) << m;
    EXPECT_LT(map::angle_rad(result.rig->moves()[m].T_after_initial, moves[m].T_after_initial), 0.04 * kDegree) << m;
  }
  EXPECT_NEAR(result.moves[2].change_deg, 0.4, 0.04);  // relative to its extrinsics after the first move
}

// The place of a camera after a move is not kept near the calibration, if it is far from it.
TEST(MovedCamera, MayBeDisplacedFar) {
  const camera::Rig rig = synthetic::default_rig();
  const Moved moved{1, 15, turn({0, 0.5, 0}, {0.03, 0, 0})};
  const RigRefinement result = refined(map_of(rig, moved));
  ASSERT_EQ(result.moves.size(), 1u);
  EXPECT_LT((result.rig->moves()[0].T_after_initial.translation() - moved.T_after_initial.translation()).norm(), 0.002);
  for (std::size_t c = 1; c < rig.size(); ++c)
    EXPECT_LT((result.rig->cam_from_rig(c).translation() - rig.cam_from_rig(c).translation()).norm(),
              0.003 * result.cameras[c].std_mm)
        << c;
}

// The single baseline of two cameras does not show that the second one is far from its calibrated place.
TEST(MovedCamera, MayBeDisplacedFarInARigOfTwo) {
  const Moved moved{1, 15, turn({0, 0, 0}, {0.02, 0, 0})};
  const RigRefinement result = refined(map_of(synthetic::ring_rig(2), moved));
  ASSERT_EQ(result.moves.size(), 1u);
  const Eigen::Vector3d error =
      result.rig->moves()[0].T_after_initial.translation() - moved.T_after_initial.translation();
  EXPECT_LT(error.norm(), 0.003) << result.moves[0].change_mm << " mm +- " << result.moves[0].std_mm;
}

TEST(MovedCamera, CountsItsObservationsBeforeAndAfter) {
  const camera::Rig rig = synthetic::default_rig();
  const RigRefinement still = refined(map_of(rig, {1, kKeyframes, SE3()}));
  const RigRefinement moved = refined(map_of(rig, {1, 4, turn({0, 0.4, 0})}));
  ASSERT_EQ(moved.moves.size(), 1u);
  EXPECT_GT(moved.cameras[1].observations, 0.9 * still.cameras[1].observations);
}

TEST(MovedCamera, IsNotFoundInMapsOfConstantRigs) {
  const camera::Rig truth = synthetic::default_rig();
  // The calibration of a camera is wrong from the beginning.
  const map::BundledMap map = map_of(with_extrinsics(truth, {1, 0, turn({0.2, 0.5, 0})}), {1, kKeyframes, SE3()});
  const RigRefinement result = refine_rig(map, truth, kIndependent, kFeatures);
  ASSERT_TRUE(result.done);
  EXPECT_EQ(result.verdict, Verdict::kInconsistent);
  EXPECT_TRUE(result.moves.empty());
}

// The first images of cameras that capture at different times are wrong, because the motion until then is not known.
TEST(MovedCamera, IsNotFoundBecauseOfAFewImagesAtTheBeginningOrTheEnd) {
  for (const int keyframe : {1, 2, kKeyframes - 1}) {
    const RigRefinement result = refined(map_of(synthetic::default_rig(), {1, keyframe, turn({0, 0.5, 0.2})}));
    ASSERT_TRUE(result.done);
    EXPECT_TRUE(result.moves.empty()) << keyframe;
  }
}

TEST(MovedCamera, OfARigOfTwoIsTheSecondOne) {
  const Moved moved{1, 15, turn({0.3, 0, 0})};
  const RigRefinement result = refined(map_of(synthetic::ring_rig(2), moved));
  ASSERT_EQ(result.moves.size(), 1u);
  EXPECT_EQ(result.moves[0].camera, 1u);
}

// A camera that swings on its mount has no constant extrinsics, and no few moves explain its images. Estimates with
// moves would take many steps in vain.
TEST(MovedCamera, IsNotSearchedForIfTheEstimateDoesNotSettle) {
  std::vector<Moved> swings;
  for (int i = 0; i < kKeyframes; ++i)
    swings.push_back({1, i, turn({2 * std::sin(1.3 * i), 3 * std::sin(0.7 * i), 2 * std::cos(1.1 * i)})});
  const map::BundledMap map = map_of(synthetic::default_rig(), swings);
  const EstimateInput input{map, map.rig(), kIndependent, kFeatures, {}};
  const MovedCameras none(map.rig().size(), {});
  const RigAdjustmentOptions prior = prior_with_timing(input, none);
  const WorkCounts begin = work_so_far();
  ASSERT_FALSE(estimate_rig(input, prior, none).settled);
  const WorkCounts constant = work_so_far();
  EXPECT_TRUE(moves_of(estimate_rig_and_moves(input, prior, none)).empty());
  EXPECT_EQ((work_so_far() - constant).solver_steps, (constant - begin).solver_steps);
}

// The problem with moves as further cameras has the same errors as that with moves as motions.
TEST(MovedCameras, SeparateAndJoinAreInverse) {
  const map::BundledMap map = map_of(synthetic::default_rig(), {1, kKeyframes, SE3()});
  const MovedCameras cameras(map.rig().size(), {{1, time_of(map, 10), turn({0.3, 0, 0})},
                                                {3, time_of(map, 15), turn({0, 0.2, 0})},
                                                {1, time_of(map, 20), turn({0, 0, 0.4})}});
  EXPECT_EQ(cameras.before(0), 1u);
  EXPECT_EQ(cameras.before(1), 3u);
  EXPECT_EQ(cameras.before(2), map.rig().size());
  const solver::RigValues values = cameras.added_to(solver::RigValues::of(map.rig()));
  const camera::Rig rig = cameras.added_to(map.rig());
  RigProblem problem = choose(map, false, kIndependent, kFeatures);
  const std::vector<solver::ReprojectionProblem::Observation> original = problem.selected.problem.observations;
  cameras.separate(map, problem);
  problem.selected.problem.rig = &rig;
  const auto errors = [&](const solver::RigValues& of_rig) {
    const solver::ReprojectionProblem& bundle = problem.selected.problem;
    std::vector<double> out = solver::squared_errors(bundle, bundle.T_rig_world, bundle.points, of_rig);
    std::ranges::sort(out);
    return out;
  };
  const std::vector<double> separate = errors(values);
  cameras.join(map, values, problem);
  problem.selected.problem.rig = &map.rig();
  const std::vector<double> joined = errors(cameras.of_rig(values));
  ASSERT_EQ(joined.size(), separate.size());
  for (std::size_t i = 0; i < joined.size(); ++i) EXPECT_NEAR(joined[i], separate[i], 1e-6 * (1 + separate[i]));
  ASSERT_EQ(problem.selected.problem.observations.size(), original.size());
  for (std::size_t i = 0; i < original.size(); ++i)
    EXPECT_EQ(problem.selected.problem.observations[i].camera, original[i].camera);
}

// The information about the cameras of the rig is the inverse of their part of the covariance.
TEST(MovedCameras, MarginaliseTheirExtrinsics) {
  constexpr Eigen::Index kUnknowns = 6 * (3 - 1) + 6 + 4;  // three cameras, a move, and four others
  const Eigen::MatrixXd random = Eigen::MatrixXd::Random(kUnknowns, kUnknowns);
  const Eigen::MatrixXd information = random * random.transpose() + Eigen::MatrixXd::Identity(kUnknowns, kUnknowns);
  const MovedCameras cameras(3, {{2, 5, SE3()}});
  const RigInformation all{Eigen::VectorXd::LinSpaced(kUnknowns, 0, kUnknowns - 1), information, 2 * information};
  const RigInformation of_rig = cameras.of_rig(all);
  std::vector<Eigen::Index> kept(16);
  for (Eigen::Index k = 0; k < 16; ++k) kept[static_cast<std::size_t>(k)] = k < 12 ? k : k + 6;
  const Eigen::MatrixXd covariance = information.inverse();
  const Eigen::MatrixXd expected = covariance(kept, kept).inverse();
  EXPECT_LT((of_rig.information - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT((of_rig.prior - 2 * expected).norm(), 1e-9 * expected.norm());
  ASSERT_EQ(of_rig.change.size(), 16);
  EXPECT_EQ(of_rig.change(11), 11);
  EXPECT_EQ(of_rig.change(12), 18);
}

}  // namespace
}  // namespace bslam::calibration::moves
