#include "tracking/robust_pose.h"

#include <gtest/gtest.h>

#include <functional>

#include "estimators/pose_ransac.h"
#include "tracking/camera_consensus.h"
#include "tracking/pose_confirmation.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

// A frame in which landmarks observed by one keyframe only have moved since, and outnumber all others.
class RobustPose : public ::testing::Test {
 protected:
  RobustPose() {
    ThreadPool pool(2);
    const std::vector<LandmarkId> all = world.map.landmark_ids();
    FrameMatches found = find_landmarks(world.map, seen.frame, truth, all, {}, {.radius = 0.02}, pool).found;
    std::size_t moving = 0, at_rest = 0;
    for (const auto& camera : found) {
      for (const Match& m : camera) moving += few_observations(m);
    }
    matches.resize(found.size());
    for (std::size_t c = 0; c < found.size(); ++c) {
      for (const Match& m : found[c]) {
        if (few_observations(m) || at_rest++ < 2 * moving / 3) matches[c].push_back(m);
      }
    }
    observations = pose_observations(world.map, seen.frame, matches, {.sigma_px = 0.7, .pyramid = {}});
  }

  bool few_observations(const Match& m) const { return world.map.observations(m.landmark).size() == 1; }

  // Moves the pixels of the moving landmarks, of those with odd ids by another distance.
  void move(const Eigen::Vector3d& of_even, const Eigen::Vector3d& of_odd) {
    std::size_t i = 0;
    for (const auto& camera : matches) {
      for (const Match& m : camera) {
        solver::PoseObservation& o = observations[i++];
        if (!few_observations(m)) continue;
        const Eigen::Vector3d& distance = m.landmark.value() % 2 == 0 ? of_even : of_odd;
        move(distance, o);
      }
    }
  }

  // Moves the pixel as if the point had moved by this distance.
  void move(const Eigen::Vector3d& distance, solver::PoseObservation& o) const {
    const geometry::SE3 T_cam_world = world.map.rig().cam_from_rig(o.camera) * truth;
    const auto& model = world.map.rig().camera(o.camera);
    const auto before = model.project(T_cam_world * o.point_world),
               now = model.project(T_cam_world * (o.point_world + distance));
    if (before && now) o.pixel += *now - *before;
  }

  // Moves the point along its ray to a fifth of its distance.
  void bring_near(solver::PoseObservation& o) const {
    const geometry::SE3 T_cam_world = world.map.rig().cam_from_rig(o.camera) * truth;
    o.point_world = T_cam_world.inverse() * (0.2 * (T_cam_world * o.point_world));
  }

  // A person near the rig: this number of twelve landmarks each, which have moved by this distance.
  struct Person {
    int landmarks;
    Eigen::Vector3d moved;
  };

  // Keeps new landmarks only. Those that are not on people are at rest.
  void let_people_walk(std::initializer_list<Person> people) {
    std::vector<solver::PoseObservation> kept;
    FrameMatches new_ones(matches.size());
    std::size_t i = 0;
    for (std::size_t c = 0; c < matches.size(); ++c) {
      for (const Match& m : matches[c]) {
        solver::PoseObservation o = observations[i++];
        if (!few_observations(m)) continue;
        int part = m.landmark.value() % 12;
        for (const Person& person : people) {
          if (part >= 0 && part < person.landmarks) {
            bring_near(o);
            move(person.moved, o);
          }
          part -= person.landmarks;
        }
        kept.push_back(o);
        new_ones[c].push_back(m);
      }
    }
    matches = new_ones;
    observations = kept;
  }

  double error(const solver::PoseSolution& solution) const {
    return (solution.T_rig_world.inverse().translation() - truth.inverse().translation()).norm();
  }

  solver::PoseSolution pose(const geometry::SE3& predicted) const { return chosen(predicted).solution; }

  ChosenPose chosen(const geometry::SE3& predicted) const {
    const TrackerState state;
    return robust_pose({.map = world.map, .pyramids = {}, .alignment = {}, .state = state}, seen.frame, matches,
                       observations, predicted, motion, {});
  }

  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 1.0, 0.5);
  synthetic::SimulatedFrame seen = world.sim.frame(FrameId(1), 0.1);
  geometry::SE3 truth = seen.T_world_rig.inverse();
  FrameMatches matches;
  std::vector<solver::PoseObservation> observations;
  solver::MotionModel motion{.delay_s = {0, 0, 0, 0}, .T_before = truth, .gain = 0.0};
};

TEST_F(RobustPose, FollowsLandmarksThatManyKeyframesObserve) {
  move({0.2, 0.05, -0.1}, {0.2, 0.05, -0.1});
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.05);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.005);
}

TEST_F(RobustPose, IsContestedByAnotherMotionInTheSameImages) {
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_FALSE(chosen(predicted).contest.contested);
  const std::vector<solver::PoseObservation> at_rest = observations;
  std::size_t i = 0;
  for (const auto& camera : matches) {
    for (std::size_t k = 0; k < camera.size(); ++k, ++i) {
      if (k % 2 == 0) move({0.2, 0.05, -0.1}, observations[i]);
    }
  }
  const ChosenPose of_two = chosen(predicted);
  EXPECT_TRUE(of_two.contest.contested && of_two.contest.undecided);

  observations = at_rest;
  Random random(1, "outliers", 0);
  for (std::size_t k = 0; k < observations.size(); k += 3)
    observations[k].pixel += 40 * Eigen::Vector2d(random.uniform() - 0.5, random.uniform() - 0.5);
  const ChosenPose scattered = chosen(predicted);
  EXPECT_LT(error(scattered.solution), 0.005);
  EXPECT_FALSE(scattered.contest.contested || scattered.contest.undecided);
}

// All landmarks of camera 0 are at rest, all others move.
TEST_F(RobustPose, IsNotContestedByAnotherMotionInOtherImages) {
  std::size_t i = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (std::size_t k = 0; k < matches[c].size(); ++k, ++i) {
      if (c > 0) move({0.2, 0.05, -0.1}, observations[i]);
    }
  }
  const ChosenPose late = chosen(truth);
  ASSERT_TRUE(late.solution.ok);
  EXPECT_LT(late.solution.num_inliers, 0.8 * static_cast<double>(observations.size()));
  EXPECT_FALSE(late.contest.contested || late.contest.undecided);
}

TEST_F(RobustPose, FollowsTheMajorityIfThePredictionIsWrong) {
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0.01, 0.02, 0, 0.1, 0.05, 0).finished());
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.005);
}

// Neither the majority of the matches nor those near the prediction lead to the pose.
TEST_F(RobustPose, IsFoundBySamplesIfTheInitialPoseAgreesWithFew) {
  move({0.3, 0, 0.1}, {0.6, 0, 0.2});
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 0, 0, -0.4, 0, 0).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.05);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.01);
}

// An inlier counts a half plus the time between the keyframes that observe its landmark; those of one cell as the
// largest.
TEST_F(RobustPose, OfWideWindowsFollowsTheLargerSupportAsWell) {
  move({0.2, 0.05, -0.1}, {0.2, 0.05, -0.1});
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 0.01, 0, 0.04, 0, 0.02).finished());
  const camera::Rig rig = frame::rig_of(world.map.rig(), seen.frame);
  const auto majority = estimators::ransac_pose(rig, observations, predicted, {}, {}, Random(1, "test", 0));
  ASSERT_TRUE(majority.ok);
  EXPECT_GT(error(majority), 0.05);
  const TrackerState state;
  const auto solution = sampled_pose({.map = world.map, .pyramids = {}, .alignment = {}, .state = state}, seen.frame,
                                     matches, observations, predicted, {})
                            .solution;
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.005);
}

// What moves outnumbers the rest in the images of every camera, so that no pose from a single camera is right. If the
// cameras contradict each other, the pose of all is kept if it is nearest to the prediction.
TEST_F(RobustPose, OfSingleCamerasIsUsedOnlyIfCamerasContradictEachOther) {
  std::size_t i = 0;
  for (const auto& camera : matches) {
    for (std::size_t k = 0; k < camera.size(); ++k, ++i) {
      if (k % 9 < 5) move({0.2, 0.05, -0.1}, observations[i]);
    }
  }
  const camera::Rig rig = frame::rig_of(world.map.rig(), seen.frame);
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  solver::PoseSolverOptions near_start;
  near_start.first_chi2 = 25.0;
  const auto consistent = [&](const solver::PoseSolution& of_all) {
    return pose_of_most_consistent_camera(rig, matches, observations, of_all, predicted, {}, {});
  };
  const auto at_rest = [&] { return solver::solve_pose(rig, observations, predicted, near_start); };
  for (const auto& of_all : {solver::PoseSolution(), at_rest()})
    EXPECT_FALSE(consistent(of_all).ok);  // the poses from single cameras agree with each other
  for (solver::PoseObservation& o : observations) {
    if (o.camera.index() > 0) o.pixel.x() += 30;  // all other cameras are turned
  }
  for (const bool known : {false, true}) {
    const auto chosen = consistent(known ? at_rest() : solver::PoseSolution());
    ASSERT_TRUE(chosen.ok);
    EXPECT_EQ(error(chosen) < 0.005, known) << error(chosen);
  }
}

TEST_F(RobustPose, SupportIsTheSpreadOverImagesAndTime) {
  std::vector<std::uint8_t> inlier(count(matches), 0);
  EXPECT_EQ(support(world.map, matches, observations, inlier).sum(), 0);
  double sum = 0, most = 0;
  std::size_t i = 0;
  for (const Match& m : matches[0]) {
    std::ranges::fill(inlier, std::uint8_t{0});
    inlier[i++] = 1;
    std::vector<TimeNs> times;
    for (const map::Observation& o : world.map.observations(m.landmark))
      times.push_back(world.map.keyframe(o.keyframe).frame->time_ns);
    const auto [first, last] = std::ranges::minmax(times);
    const double expected = 0.5 + std::min(1.0, to_seconds(last - first));
    EXPECT_DOUBLE_EQ(support(world.map, matches, observations, inlier).sum(), expected);
    sum += expected;
    most = std::max(most, expected);
  }
  std::ranges::fill(inlier, std::uint8_t{0});
  std::fill_n(inlier.begin(), i, std::uint8_t{1});
  const double spread = support(world.map, matches, observations, inlier).sum();
  EXPECT_GT(spread, 4 * most);
  EXPECT_LT(spread, sum);
  for (std::size_t k = 0; k < i; ++k) observations[k].pixel = observations[0].pixel;
  EXPECT_DOUBLE_EQ(support(world.map, matches, observations, inlier).sum(), most);
}

// New landmarks, which move, outnumber those that agreed with an earlier frame and are spread more widely.
TEST_F(RobustPose, FollowsConfirmedLandmarks) {
  std::vector<solver::PoseObservation> kept;
  FrameMatches of_both(matches.size());
  std::vector<std::uint8_t> moving, at_rest;
  std::size_t i = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      solver::PoseObservation o = observations[i++];
      const std::size_t times = world.map.observations(m.landmark).size();
      if (times > 2 || (times == 1 && m.landmark.value() % 2 == 0)) continue;
      if (times == 1) move({0.2, 0.05, -0.1}, o);
      moving.push_back(times == 1);
      at_rest.push_back(times == 2);
      kept.push_back(o);
      of_both[c].push_back(m);
    }
  }
  matches = of_both;
  observations = kept;
  EXPECT_GT(std::ranges::count(moving, std::uint8_t{1}), 3 * std::ranges::count(at_rest, std::uint8_t{1}));
  EXPECT_GT(support(world.map, matches, observations, moving).sum(),
            1.1 * support(world.map, matches, observations, at_rest).sum());
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.05);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.03);
}

// Landmarks on a small part of an image outnumber all others, and have been observed as long.
TEST_F(RobustPose, FollowsLandmarksThatSpreadOverTheImages) {
  const camera::Camera& camera = world.map.rig().camera(std::size_t{0});
  std::vector<solver::PoseObservation> kept;
  FrameMatches spread(matches.size());
  std::size_t i = 0;
  const auto in_part = [&](const solver::PoseObservation& o) {
    return o.camera.index() == 0 && std::abs(o.pixel.x() - 0.5 * camera.width) < 0.2 * camera.width &&
           std::abs(o.pixel.y() - 0.5 * camera.height) < 0.3 * camera.height;
  };
  std::size_t in = 0, out = 0;
  for (const solver::PoseObservation& o : observations) in += in_part(o);
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      solver::PoseObservation o = observations[i++];
      if (in_part(o)) {
        move({0.2, 0.05, -0.1}, o);
      } else if (3 * out++ >= 2 * in) {
        continue;
      }
      kept.push_back(o);
      spread[c].push_back(m);
    }
  }
  ASSERT_GT(in, 20u);
  matches = spread;
  observations = kept;
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.05);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.03);
}

// Landmarks near the rig outnumber all others, and are spread over the images as widely.
TEST_F(RobustPose, FollowsLandmarksThatSpreadInSpace) {
  std::vector<solver::PoseObservation> kept;
  FrameMatches of_both(matches.size());
  std::vector<std::uint8_t> near, far;
  std::size_t i = 0, at_rest = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      solver::PoseObservation o = observations[i++];
      const bool moves = m.landmark.value() % 2 == 0;
      if (!moves && at_rest++ % 2 == 0) continue;
      if (moves) {
        bring_near(o);
        move({0.06, 0.02, -0.04}, o);
      }
      near.push_back(moves);
      far.push_back(!moves);
      kept.push_back(o);
      of_both[c].push_back(m);
    }
  }
  matches = of_both;
  observations = kept;
  EXPECT_GT(support(world.map, matches, observations, near).sum(),
            1.1 * support(world.map, matches, observations, far).sum());
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.03);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.005);
}

// Two people near the rig, each with more than twice as many landmarks as the scene behind them.
TEST_F(RobustPose, FollowsTheSceneBehindTwoMovingObjects) {
  let_people_walk({{6, {0.04, 0.01, -0.03}}, {4, {0.12, 0.03, -0.09}}});
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  EXPECT_GT(error(solver::solve_pose(world.map.rig(), observations, predicted, motion, {})), 0.03);
  const ChosenPose found = chosen(predicted);
  ASSERT_TRUE(found.solution.ok);
  EXPECT_LT(error(found.solution), 0.01);
  // The landmarks on people, which are four fifths of all, are no evidence against the pose.
  EXPECT_LT(found.solution.num_inliers, 0.25 * static_cast<double>(observations.size()));
  EXPECT_GT(found.solution.num_inliers, 0.8 * static_cast<double>(found.matches));
}

// One of them moves so little that most landmarks of the scene, which are farther away, agree with this motion as well.
TEST_F(RobustPose, FollowsTheMotionThatPredictsFarLandmarksBetter) {
  let_people_walk({{5, {0.02, 0.005, -0.015}}, {3, {0.12, 0.03, -0.09}}});
  const geometry::SE3 predicted = truth.perturbed((geometry::Vector6d() << 0, 1e-3, 0, 0.002, 0, 0.001).finished());
  const auto of_person = solver::solve_pose(world.map.rig(), observations, predicted, motion, {});
  EXPECT_GT(error(of_person), 0.015);
  const auto of_scene = solver::solve_pose(world.map.rig(), observations, truth, motion, {.rounds = 0});
  std::size_t scene_only = 0;
  for (std::size_t k = 0; k < observations.size(); ++k) scene_only += of_scene.inlier[k] && !of_person.inlier[k];
  EXPECT_LT(static_cast<double>(scene_only), of_scene.num_inliers / 3.0);
  const auto solution = pose(predicted);
  ASSERT_TRUE(solution.ok);
  EXPECT_LT(error(solution), 0.01);
}

// Most matches are replaced by wrong ones, which are anywhere in a window of this radius around the right pixel.
TEST_F(RobustPose, FewRightMatchesConfirmAPoseAndWrongOnesDoNot) {
  constexpr double kWindow_px = 8.0;
  Random random(1, "wrong matches");
  const std::vector<double> windows(observations.size(), kWindow_px);
  const auto mislead = [&](std::size_t i) {
    Eigen::Vector2d offset;
    do {
      offset = kWindow_px * Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
    } while (offset.norm() > kWindow_px);
    observations[i].pixel += offset;
  };
  const auto confirmed = [&] {
    const auto agrees = agreeing_beyond_chance(world.map.rig(), observations, windows, truth, motion);
    return std::ranges::count(agrees, std::uint8_t{1}) > 0;
  };
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (i % 4 != 0) mislead(i);
  }
  EXPECT_TRUE(confirmed());
  for (std::size_t i = 0; i < observations.size(); i += 4) mislead(i);
  EXPECT_FALSE(confirmed());
}

// In windows hardly larger than the noise, wrong matches agree as well.
TEST_F(RobustPose, MatchesConfirmThePoseOnlyInWindowsLargerThanTheNoise) {
  const TrackerState state = state_at_first(world);
  const auto confirmed = [&](double radius, const geometry::SE3& T_rig_world) {
    return confirmed_by_matches({.map = world.map, .pyramids = {}, .alignment = {}, .state = state}, seen.frame,
                                matches, radius, T_rig_world);
  };
  EXPECT_TRUE(confirmed(0.02, truth));
  EXPECT_FALSE(confirmed(0.02, truth.perturbed((geometry::Vector6d() << 0, 0.1, 0, 0, 0, 0).finished())));
  EXPECT_FALSE(confirmed(0.001, truth));
}

}  // namespace
}  // namespace bslam::tracking
