#include "calibration/image_residuals.h"

#include <gtest/gtest.h>

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
