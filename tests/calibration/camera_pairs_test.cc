#include "calibration/camera_pairs.h"

#include <gtest/gtest.h>

#include "calibration/rig_warnings.h"
#include "camera/stereo_rig.h"
#include "geometry/so3.h"
#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

// Two cameras that overlap, the second one turned by 15 degrees, so that exchanging them is noticed at all distances.
camera::Rig turned_pair() {
  const camera::Rig rig = synthetic::ring_rig(2);
  const geometry::SE3 turned(geometry::so3_exp({0, geometry::radians(15), 0}), Eigen::Vector3d::Zero());
  return camera::Rig({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1) * turned}});
}

// Keyframes of two cameras that overlap. `matched_share`: fraction of the common landmarks that were matched.
map::SimulatedMap seen_by(const camera::Rig& rig, double matched_share, int max_keypoints = 300) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = max_keypoints;
  options.matched_share = matched_share;
  map::SimulatedMap out(synthetic::FeatureSimulator(rig, synthetic::make_orbit({.duration_s = 60}), options));
  for (int i = 0; i < 6; ++i) out.add_keyframe(FrameId(i), 0.5 * i);
  return out;
}

std::vector<CameraPair> tested(const map::SimulatedMap& seen, const camera::Rig& given, const camera::Rig& final_rig) {
  return test_pairs(seen.map, seen.map.keyframe_ids(), 0, given, final_rig);
}

TEST(CameraPairs, WithMatchedFeaturesNeedNoFurtherTest) {
  const camera::Rig rig = synthetic::ring_rig(2);
  const auto pairs = tested(seen_by(rig, 0.8), rig, rig);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].keyframes, 6);
  EXPECT_GT(pairs[0].overlap, 0.4);
  EXPECT_GT(pairs[0].matched_share(), 0.2);
  EXPECT_FALSE(pairs[0].evidence);
  EXPECT_FALSE(pairs[0].hardly_matched());
  EXPECT_FALSE(pairs[0].contradicted);
}

// With a wrong calibration hardly anything is matched between the cameras, and the estimate of the calibration sees
// only what agrees with it.
TEST(CameraPairs, RevealExchangedCamerasAndInvertedTransforms) {
  const camera::Rig rig = turned_pair();
  const map::SimulatedMap seen = seen_by(rig, 0);
  const std::array exchange = {1, 0};
  for (const camera::Rig& wrong : {rig.subset(exchange), with_inverse_extrinsics(rig)}) {
    const auto pairs = tested(seen, wrong, wrong);
    ASSERT_TRUE(pairs[0].evidence);
    EXPECT_TRUE(pairs[0].contradicted) << describe_pair(*pairs[0].evidence);
    EXPECT_GT(pairs[0].evidence->matches, 200);
    EXPECT_FALSE(tested(seen, wrong, rig)[0].contradicted);  // the estimate has corrected it
  }
  const auto pairs = tested(seen, rig, rig);
  EXPECT_TRUE(pairs[0].hardly_matched());
  EXPECT_FALSE(pairs[0].contradicted);
}

// The same with principal points in the middle of the images, so that mirrored images are those of another rig.
camera::Rig centred_pair() {
  const camera::Rig rig = turned_pair();
  const camera::Camera camera = camera::stereo_rig().camera(0u);
  return camera::Rig({{camera, rig.body_from_cam(0)}, {camera, rig.body_from_cam(1)}});
}

// The rig whose images are those of `rig` after mirroring.
camera::Rig mirrored(const camera::Rig& rig) {
  const Eigen::Vector3d flip(-1, 1, 1);
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3 T = rig.rig_from_cam(c);
    const Eigen::Matrix3d R = flip.asDiagonal() * T.matrix3() * flip.asDiagonal();
    const Eigen::Vector3d t = flip.asDiagonal() * T.translation();
    cameras.push_back({rig.camera(c), rig.body_from_cam(0) * geometry::SE3(Eigen::Quaterniond(R), t)});
  }
  return camera::Rig(std::move(cameras));
}

// The refinement makes mirrored images of two cameras fit, so that they share many features.
TEST(CameraPairs, RevealMirroredImagesThatWereMatched) {
  const camera::Rig rig = centred_pair();
  const map::SimulatedMap seen = seen_by(mirrored(rig), 0.8);
  EXPECT_FALSE(tested(seen, rig, rig)[0].contradicted);
  const auto suspected = test_pairs(seen.map, seen.map.keyframe_ids(), 0, rig, rig, true);
  ASSERT_TRUE(suspected[0].evidence);
  EXPECT_TRUE(suspected[0].mirrored()) << describe_pair(*suspected[0].evidence);
  const map::SimulatedMap right = seen_by(rig, 0.8);
  EXPECT_FALSE(test_pairs(right.map, right.map.keyframe_ids(), 0, rig, rig, true)[0].contradicted);
  // An offset between the times that was estimated hides no pair.
  std::vector<camera::RigCamera> later{{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1)}};
  later[1].camera.time_offset_ns = 8'000'000;
  const auto moved = test_pairs(seen.map, seen.map.keyframe_ids(), 0, rig, camera::Rig(later), true);
  EXPECT_TRUE(moved[0].mirrored());
}

// The refinement makes images of exchanged cameras fit with points that are far away.
TEST(CameraPairs, RevealExchangedCamerasThatWereMatched) {
  const camera::Rig rig = centred_pair();
  const std::array exchange = {1, 0};
  const map::SimulatedMap seen = seen_by(rig.subset(exchange), 0.8);
  EXPECT_FALSE(tested(seen, rig, rig)[0].contradicted);
  const auto suspected = test_pairs(seen.map, seen.map.keyframe_ids(), 0, rig, rig, true);
  EXPECT_TRUE(suspected[0].contradicted && !suspected[0].mirrored());
  // The refinement has found the true arrangement.
  const auto found = test_pairs(seen.map, seen.map.keyframe_ids(), 0, rig, rig.subset(exchange), true);
  EXPECT_FALSE(found[0].contradicted);
}

// A translation in the axes of another frame. The refinement has found the direction of the baseline, but not its
// length.
TEST(CameraPairs, RevealABaselineThatWasRefinedToAnotherLength) {
  const camera::Rig rig = centred_pair();
  const map::SimulatedMap seen = seen_by(rig, 0.8);
  const auto with_centre = [&](const Eigen::Vector3d& centre) {
    return camera::Rig(
        {{rig.camera(std::size_t{0}), rig.body_from_cam(0)},
         {rig.camera(std::size_t{1}), rig.body_from_cam(0) * geometry::SE3(rig.rig_from_cam(1).rotation(), centre)}});
  };
  const Eigen::Vector3d centre = rig.rig_from_cam(1).translation();
  const camera::Rig wrong = with_centre({centre.z(), centre.x(), centre.y()});
  for (const auto& [factor, contradicted] : {std::pair(0.5, true), std::pair(1.05, false)}) {
    const auto pairs = test_pairs(seen.map, seen.map.keyframe_ids(), 0, wrong, with_centre(factor * centre), true);
    ASSERT_TRUE(pairs[0].evidence);
    EXPECT_EQ(pairs[0].contradicted, contradicted) << factor << ": " << describe_pair(*pairs[0].evidence);
  }
}

TEST(CameraPairs, OfDarkOrSeparateViewsAreNotAccused) {
  const camera::Rig rig = turned_pair();
  const std::array exchange = {1, 0};
  const auto dark = tested(seen_by(rig, 0, 40), rig.subset(exchange), rig.subset(exchange));
  EXPECT_EQ(dark[0].keyframes, 0);
  EXPECT_FALSE(dark[0].hardly_matched() || dark[0].contradicted);
  std::vector<camera::RigCamera> apart;
  for (std::size_t c = 0; c < 2; ++c) {
    const geometry::SE3 turned(geometry::so3_exp({0, c == 0 ? 0.0 : 3.14, 0}), Eigen::Vector3d::Zero());
    apart.push_back({rig.camera(c), rig.body_from_cam(0) * turned});
  }
  const camera::Rig separate(std::move(apart));
  const auto pairs = tested(seen_by(separate, 0.8), separate, separate);
  EXPECT_LT(pairs[0].overlap, 0.05);
  EXPECT_FALSE(pairs[0].hardly_matched() || pairs[0].contradicted);
}

// Two cameras that look in directions 95 degrees apart. According to their calibrations, each observes directions up to
// 165 degrees to the right as well, where the images of a real lens are black.
TEST(CameraPairs, PartsOfImagesWithoutFeaturesDoNotOverlap) {
  const geometry::SE3 ahead = synthetic::ring_rig(2).body_from_cam(0);
  const auto pair_of = [&ahead](int width) {
    std::vector<camera::RigCamera> cameras;
    for (const double angle : {0.0, geometry::radians(95)}) {
      const camera::KannalaBrandt lens({190, 190, 149.5, 149.5}, {0.003, 0.0007, -0.002, 0.0002});
      const geometry::SE3 turned(geometry::so3_exp({0, angle, 0}), Eigen::Vector3d(angle > 0 ? 0.1 : 0.0, 0, 0));
      cameras.push_back({camera::Camera{angle > 0 ? "right" : "front", lens, width, 300, 0, ""}, ahead * turned});
    }
    return camera::Rig(std::move(cameras));
  };
  const camera::Rig calibrated = pair_of(700);
  ASSERT_GT(calibrated.overlap_share(0, 1), 0.4);
  const auto pairs = tested(seen_by(pair_of(300), 0.8), calibrated, calibrated);
  EXPECT_EQ(pairs[0].keyframes, 6);
  EXPECT_LT(pairs[0].overlap, 0.2);
  EXPECT_FALSE(pairs[0].hardly_matched());
}

// A camera that was knocked is a matter of the refinement.
TEST(CameraPairs, AnotherArrangementIsNoSmallRotation) {
  PairEvidence evidence{.matches = 100, .agreeing = {5, 1, 1, 1, 1}, .other = OtherPose{90, 1.5, 10}};
  EXPECT_FALSE(shows_another_arrangement(evidence));
  evidence.other->rotated_deg = 90;
  EXPECT_TRUE(shows_another_arrangement(evidence));
  evidence.agreeing[0] = 50;
  EXPECT_FALSE(shows_another_arrangement(evidence));
  EXPECT_TRUE(shows_another_arrangement({.matches = 100, .exchanged = OtherCalibrations{{"left", "right"}, 60}}));
}

}  // namespace
}  // namespace bslam::calibration
