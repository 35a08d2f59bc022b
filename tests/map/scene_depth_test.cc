#include "map/scene_depth.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::map {
namespace {

TEST(MedianDepth, IsTheMedianDistance) {
  BundledMap map(synthetic_rig(1));
  Random random(1);
  const geometry::SE3 T_rig_world(Eigen::Quaterniond::Identity(), {0, 0, 1});
  const KeyframeId k = map.add_keyframe(synthetic_frame(random, 1, 10, 0), T_rig_world, {}, {});
  EXPECT_EQ(median_depth(map, k), 0.0);
  for (const double z : {2.0, 9.0, 4.0}) {
    const std::vector<Observation> seen = {{k, FeatureId(map.num_landmarks())}};
    map.add_landmark({0, 0, z}, seen);
  }
  EXPECT_DOUBLE_EQ(median_depth(map, k), 5.0);
}

}  // namespace
}  // namespace bslam::map
