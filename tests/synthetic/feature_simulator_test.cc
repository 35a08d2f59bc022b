#include "synthetic/feature_simulator.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <set>

#include "feature/hamming.h"
#include "synthetic/rigs.h"

namespace bslam::synthetic {
namespace {

FeatureSimulator simulator(camera::Rig rig, const FeatureSimulatorOptions& options = {}) {
  return FeatureSimulator(std::move(rig), make_orbit({}), options);
}

void check_invariants(const frame::BundledFrame& frame) {
  std::size_t seen = 0;
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    const auto refs = frame.bundled.keypoints(FeatureId(f));
    EXPECT_EQ(refs.size() >= 2, frame.bundled.is_matched(FeatureId(f)));
    std::set<int> cameras;
    for (const frame::KeypointRef& ref : refs) {
      EXPECT_TRUE(cameras.insert(ref.camera.value()).second);
      EXPECT_EQ(frame.bundled.feature(ref), FeatureId(f));
      EXPECT_LT(ref.keypoint.index(), frame.keypoints(ref.camera).size());
      ++seen;
    }
  }
  EXPECT_EQ(seen, frame.num_keypoints());
}

TEST(FeatureSimulator, SatisfiesTheInvariantsOfTheBundledTable) {
  std::vector<camera::Rig> rigs = {default_rig(), fisheye_rig(2), mixed_rig()};
  for (int n = 1; n <= 8; ++n) rigs.push_back(ring_rig(n));
  for (const camera::Rig& rig : rigs) {
    const SimulatedFrame out = simulator(rig).frame(FrameId(3), 1.7);
    ASSERT_EQ(out.frame.cameras.size(), rig.size());
    check_invariants(out.frame);
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const feature::Keypoints& k = out.frame.cameras[c].keypoints;
      EXPECT_GT(k.size(), 150u);
      for (const std::size_t length : {k.level.size(), k.angle.size(), k.sigma.size(), k.bearing.size(),
                                       k.descriptor.size(), k.patch.size(), out.landmark[c].size()}) {
        EXPECT_EQ(length, k.size());
      }
    }
    if (rig.size() >= 2 && rig.overlap(0, 1)) {
      EXPECT_GT(out.frame.bundled.num_matched(), 50u);
    }
  }
}

TEST(FeatureSimulator, ReprojectsWithinItsNoise) {
  const FeatureSimulator s = simulator(default_rig());
  double sum = 0, count = 0;
  for (int i = 0; i < 5; ++i) {
    const SimulatedFrame out = s.frame(FrameId(i), 0.5 * i);
    for (std::size_t c = 0; c < s.rig().size(); ++c) {
      const geometry::SE3 T_cam_world = (out.T_world_body * s.rig().body_from_cam(c)).inverse();
      const feature::Keypoints& k = out.frame.cameras[c].keypoints;
      for (std::size_t j = 0; j < k.size(); ++j) {
        if (out.landmark[c][j] < 0) continue;
        const SimulatedLandmark& l = s.landmarks()[static_cast<std::size_t>(out.landmark[c][j])];
        const auto pixel = s.rig().camera(c).project(T_cam_world * l.position);
        ASSERT_TRUE(pixel.has_value());
        sum += (k.pixel[j].cast<double>() - *pixel).squaredNorm() / (k.sigma[j] * k.sigma[j]);
        count += 2;
        EXPECT_NEAR((*s.rig().camera(c).project(k.bearing[j]) - k.pixel[j].cast<double>()).norm(), 0.0,
                    1e-4);  // pixels are floats
        EXPECT_LT(feature::hamming(k.descriptor[j], l.descriptor), 40);
      }
    }
  }
  EXPECT_GT(count, 5000);
  EXPECT_NEAR(sum / count, 1.0, 0.05);
}

TEST(FeatureSimulator, MatchesOneLandmarkAndTriangulatesItWithinItsCovariance) {
  const FeatureSimulator s = simulator(default_rig());
  const SimulatedFrame out = s.frame(FrameId(0), 2.0);
  const geometry::SE3 T_rig_world = out.T_world_rig.inverse();
  double sum = 0, count = 0;
  for (std::size_t f = 0; f < out.frame.bundled.num_matched(); ++f) {
    const auto refs = out.frame.bundled.keypoints(FeatureId(f));
    const int landmark = out.landmark[refs[0].camera.index()][refs[0].keypoint.index()];
    ASSERT_GE(landmark, 0);
    for (const frame::KeypointRef& ref : refs)
      EXPECT_EQ(out.landmark[ref.camera.index()][ref.keypoint.index()], landmark);
    const auto& point = out.frame.bundled.point(FeatureId(f));
    if (!point) continue;
    const Vector3d truth = T_rig_world * s.landmarks()[static_cast<std::size_t>(landmark)].position;
    const Vector3d error = point->point_rig - truth;
    if (error.norm() > 0.3 * truth.norm()) continue;  // distant points: the depth error is beyond first order
    sum += std::min(20.0, error.dot(point->covariance.inverse() * error));
    count += 3;
  }
  EXPECT_GT(count, 200);
  EXPECT_GT(sum / count, 0.5);
  EXPECT_LT(sum / count, 1.5);
}

TEST(FeatureSimulator, ChoosesLevelsByDistance) {
  const FeatureSimulator s = simulator(default_rig());
  const SimulatedFrame out = s.frame(FrameId(0), 2.0);
  const Vector3d camera = out.T_world_rig.translation();
  const feature::Keypoints& k = out.frame.cameras[0].keypoints;
  for (std::size_t j = 0; j < k.size(); ++j) {
    ASSERT_LT(k.level[j], s.options().levels);
    EXPECT_NEAR(k.sigma[j], s.options().sigma_px * std::pow(1.2, k.level[j]), 1e-4);
    if (out.landmark[0][j] < 0) continue;
    const SimulatedLandmark& l = s.landmarks()[static_cast<std::size_t>(out.landmark[0][j])];
    EXPECT_NEAR(std::log(l.base_distance / (l.position - camera).norm()) / std::log(1.2), k.level[j], 0.51);
  }
}

TEST(FeatureSimulator, HasSeparateSeeds) {
  const camera::Rig rig = ring_rig(2);
  const SimulatedFrame a = simulator(rig).frame(FrameId(1), 1.0), b = simulator(rig).frame(FrameId(1), 1.0);
  EXPECT_EQ(a.frame.cameras[0].keypoints.pixel, b.frame.cameras[0].keypoints.pixel);
  EXPECT_EQ(a.frame.cameras[1].keypoints.descriptor, b.frame.cameras[1].keypoints.descriptor);
  FeatureSimulatorOptions other_noise, other_scene;
  other_noise.noise_seed = 2;
  other_scene.scene_seed = 2;
  const FeatureSimulator base = simulator(rig), noise = simulator(rig, other_noise),
                         scene = simulator(rig, other_scene);
  EXPECT_EQ(base.landmarks()[0].position, noise.landmarks()[0].position);
  EXPECT_NE(base.landmarks()[0].position, scene.landmarks()[0].position);
  EXPECT_NE(noise.frame(FrameId(1), 1.0).frame.cameras[0].keypoints.pixel, a.frame.cameras[0].keypoints.pixel);
}

TEST(FeatureSimulator, ObservesNothingInMissingCameras) {
  const FeatureSimulator s = simulator(default_rig());
  const int missing[] = {1};
  const SimulatedFrame out = s.frame(FrameId(0), 1.0, missing);
  EXPECT_EQ(out.frame.cameras[1].state, image::ImageState::kMissing);
  EXPECT_TRUE(out.frame.cameras[1].keypoints.empty());
  EXPECT_FALSE(out.frame.cameras[0].keypoints.empty());
  check_invariants(out.frame);
}

TEST(FeatureSimulator, SimulatesEachCameraAtItsCaptureTime) {
  FeatureSimulatorOptions options;
  options.capture_offset_s = {0, 0.02};
  options.sigma_px = 1e-3;
  options.outlier_share = 0;
  const FeatureSimulator s = simulator(ring_rig(2), options);
  const SimulatedFrame out = s.frame(FrameId(0), 1.0);
  EXPECT_EQ(out.frame.cameras[1].time_ns - out.frame.cameras[0].time_ns, 20'000'000);
  const geometry::SE3 T_cam_world = (s.trajectory().T_world_body(1.02) * s.rig().body_from_cam(1)).inverse();
  const feature::Keypoints& k = out.frame.cameras[1].keypoints;
  for (std::size_t j = 0; j < k.size(); ++j) {
    const auto pixel = s.rig()
                           .camera(std::size_t{1})
                           .project(T_cam_world * s.landmarks()[static_cast<std::size_t>(out.landmark[1][j])].position);
    EXPECT_NEAR((k.pixel[j].cast<double>() - *pixel).norm(), 0.0, 0.05);
  }
}

}  // namespace
}  // namespace bslam::synthetic
