#include "calibration/image_residuals.h"

#include <gtest/gtest.h>

#include <array>

#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

constexpr double kSigma_px = 0.5;

map::SimulatedMap map_of(const camera::Rig& rig) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kSigma_px;
  map::SimulatedMap out(synthetic::FeatureSimulator(rig, synthetic::make_orbit({.duration_s = 60}), options));
  for (int i = 0; i < 12; ++i) out.add_keyframe(FrameId(i), 0.5 * i);
  return out;
}

// With true poses and positions the residuals are the noise of the observations, in two directions.
TEST(ImageResiduals, OfATrueMapAreTheNoise) {
  const map::SimulatedMap simulated = map_of(synthetic::ring_rig(2));
  const auto residuals = image_residuals(simulated.map);
  ASSERT_EQ(residuals.size(), 2u);
  std::size_t observations = 0;
  for (const ImageResiduals& r : residuals) {
    ASSERT_GT(r.observations, 500u);
    EXPECT_GT(r.rms_px, kSigma_px);
    EXPECT_LT(r.rms_px, 4 * kSigma_px);  // keypoints of coarser levels have more noise
    ASSERT_EQ(r.cells.size(), ImageResiduals::kColumns * ImageResiduals::kRows);
    std::size_t in_cells = 0;
    for (const ResidualCell& cell : r.cells) in_cells += cell.observations;
    EXPECT_EQ(in_cells, r.observations);
    observations += r.observations;
  }
  EXPECT_GT(observations, 0u);
  const auto later = image_residuals(simulated.map, KeyframeId(6));
  EXPECT_GT(later[0].observations, 0u);
  EXPECT_LT(later[0].observations, residuals[0].observations);
  EXPECT_EQ(image_residuals(simulated.map, KeyframeId(12))[0].observations, 0u);
}

TEST(ImageResiduals, AreNotSpoiltByOutliers) {
  map::SimulatedMap simulated = map_of(synthetic::ring_rig(2));
  const auto before = image_residuals(simulated.map);
  map::MapDraft draft = simulated.draft();
  map::SetPoses moved;
  for (const LandmarkId l : draft.map().landmark_ids()) {
    if (l.index() % 100 == 0) moved.landmarks.emplace_back(l, Eigen::Vector3d(2.0 * draft.map().landmark(l).position));
  }
  draft.set_poses(std::move(moved));
  const auto after = image_residuals(draft.map());
  for (std::size_t c = 0; c < after.size(); ++c) {
    EXPECT_LT(after[c].observations, before[c].observations);
    EXPECT_LT(after[c].rms_px, 1.2 * before[c].rms_px);
  }
}

// Keyframe 1 is the only one with an image of camera 1.
TEST(ImageResiduals, ExistForACameraThatHasImagesInFewKeyframes) {
  constexpr std::array<int, 1> kSecond = {1};
  map::SimulatedMap simulated(synthetic::FeatureSimulator(synthetic::ring_rig(2), synthetic::make_orbit({}), {}));
  for (int i = 0; i < 40; ++i) {
    const auto missing = i == 1 ? std::span<const int>() : std::span<const int>(kSecond);
    const synthetic::SimulatedFrame seen = simulated.sim.frame(FrameId(i), 0.1 * i, missing);
    const KeyframeId k = simulated.map.add_keyframe(std::make_shared<const frame::BundledFrame>(seen.frame),
                                                    seen.T_world_rig.inverse(), {}, simulated.map.newest_keyframe());
    for (std::size_t f = 0; f < seen.frame.bundled.size(); ++f) {
      const map::Observation observation{k, FeatureId(f)};
      if (const int truth = map::shown_by(seen, FeatureId(f)); truth >= 0)
        simulated.map.add_landmark(simulated.truth_of(truth), std::span(&observation, 1));
    }
  }
  EXPECT_GT(image_residuals(simulated.map)[1].observations, 50u);
}

// A focal length that is 2 % too short projects points closer to the centre, so the residuals point outward.
TEST(ImageResiduals, PointOutwardIfTheFocalLengthIsTooShort) {
  map::SimulatedMap simulated = map_of(synthetic::ring_rig(2));
  const camera::Rig truth = simulated.map.rig();
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    camera::Camera camera = truth.camera(c);
    if (c == 1) {
      camera::Intrinsics k = camera::intrinsics(camera.model);
      k.fx *= 0.98;
      k.fy *= 0.98;
      camera.model = camera::PinholeRadTan(k, camera::distortion(camera.model));
    }
    cameras.push_back({camera, truth.body_from_cam(c)});
  }
  simulated.map.set_rig(std::make_shared<const camera::Rig>(std::move(cameras)));
  const auto residuals = image_residuals(simulated.map);
  EXPECT_GT(residuals[1].rms_px, 1.5 * residuals[0].rms_px);
  const camera::Camera& camera = truth.camera(std::size_t{1});
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  int outward = 0, cells = 0;
  for (std::size_t i = 0; i < residuals[1].cells.size(); ++i) {
    const ResidualCell& cell = residuals[1].cells[i];
    if (cell.observations < 10) continue;
    const Eigen::Vector2d from_centre(
        (static_cast<double>(i % ImageResiduals::kColumns) + 0.5) * camera.width / ImageResiduals::kColumns - k.cx,
        (static_cast<double>(i / ImageResiduals::kColumns) + 0.5) * camera.height / ImageResiduals::kRows - k.cy);
    ++cells;
    outward += cell.mean_px.dot(from_centre) > 0;
  }
  ASSERT_GT(cells, 20);
  EXPECT_GT(outward, 0.9 * cells);
}

}  // namespace
}  // namespace bslam::calibration
