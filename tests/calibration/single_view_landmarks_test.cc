#include "calibration/single_view_landmarks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;

// The rig with its second camera turned by two degrees.
camera::Rig turned(const camera::Rig& rig) {
  const SE3 turn = SE3::exp((geometry::Vector6d() << 0, geometry::radians(2), 0, 0, 0, 0).finished());
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c)
    cameras.push_back({rig.camera(c), c == 1 ? rig.body_from_cam(c) * turn : rig.body_from_cam(c)});
  return camera::Rig(std::move(cameras));
}

map::SimulatedMap empty_map(const camera::Rig& rig) {
  synthetic::FeatureSimulatorOptions options;
  options.outlier_share = 0;
  return map::SimulatedMap(synthetic::FeatureSimulator(rig, synthetic::make_orbit({}), options));
}

// Root mean square of the reprojection errors of camera 1 in pixels, outliers included.
double rms_px(const map::BundledMap& map) {
  const CameraIndex camera(1);
  double sum = 0, count = 0;
  for (const LandmarkId l : map.landmark_ids()) {
    for (const map::Observation& o : map.observations(l)) {
      for (const frame::KeypointRef& ref : map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature)) {
        if (ref.camera != camera) continue;
        const auto projected =
            map.rig().camera(camera).project(map.cam_from_world(o.keyframe, camera) * map.landmark(l).position);
        if (!projected) continue;
        const Eigen::Vector2f& pixel = map.keypoints(o.keyframe, camera).pixel[ref.keypoint.index()];
        sum += (pixel.cast<double>() - *projected).squaredNorm();
        ++count;
      }
    }
  }
  return std::sqrt(sum / count);
}

TEST(SingleViewLandmarks, FollowTheCalibration) {
  const camera::Rig truth = synthetic::ring_rig(2);
  map::SimulatedMap world = empty_map(truth);
  world.add_keyframe(FrameId(0), 0.0, false);  // landmarks with stereo depth only, in one keyframe
  const double noise_px = rms_px(world.map);
  map::MapDraft draft = world.draft();
  draft.set_rig(turned(truth));
  triangulate_single_views(draft);
  draft.set_rig(truth);
  EXPECT_GT(rms_px(draft.map()), 2 * noise_px);  // positions of the other calibration
  triangulate_single_views(draft);
  EXPECT_LT(rms_px(draft.map()), 1.1 * noise_px);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(SingleViewLandmarks, LandmarksOfSeveralKeyframesKeepTheirPositions) {
  const camera::Rig truth = synthetic::ring_rig(2);
  map::SimulatedMap world = empty_map(truth);
  for (int i = 0; i < 2; ++i) world.add_keyframe(FrameId(i), 0.3 * i);
  map::MapDraft draft = world.draft();
  draft.set_rig(turned(truth));
  triangulate_single_views(draft);
  int several = 0;
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (world.map.observations(l).size() < 2) continue;
    EXPECT_EQ(draft.map().landmark(l).position, world.map.landmark(l).position);
    ++several;
  }
  EXPECT_GT(several, 100);
}

}  // namespace
}  // namespace bslam::calibration
