#include "storage/submaps.h"

#include <gtest/gtest.h>

#include "small_map.h"
#include "synthetic/rigs.h"

namespace bslam::storage {
namespace {

TEST(Submaps, AreSpanningTreesInOrderOfTime) {
  const map::BundledMap map = small_map(synthetic::default_rig());
  const std::vector<Submap> submaps = submaps_of(map);
  ASSERT_EQ(submaps.size(), 2u);
  EXPECT_EQ(submaps[0].keyframes.size() + submaps[1].keyframes.size(), map.num_keyframes());
  EXPECT_EQ(submaps[0].landmarks + submaps[1].landmarks, map.num_landmarks());
  EXPECT_EQ(submaps[1].keyframes.size(), 2u);
  for (const Submap& submap : submaps) {
    const auto trajectory = keyframe_trajectory(map, submap);
    ASSERT_EQ(trajectory.size(), submap.keyframes.size());
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      EXPECT_EQ(map.root_of(submap.keyframes[i]), submap.root);
      if (i > 0) {
        EXPECT_LT(trajectory[i - 1].time_ns, trajectory[i].time_ns);
      }
      const geometry::SE3 round = trajectory[i].T_world_frame * map.keyframe(submap.keyframes[i]).T_rig_world;
      EXPECT_LT(round.log().norm(), 1e-12);
      EXPECT_LE(
          (trajectory[i].T_world_frame.translation() - trajectory[0].T_world_frame.translation()).cwiseAbs().maxCoeff(),
          submap.extent.maxCoeff() + 1e-12);
    }
  }
}

}  // namespace
}  // namespace bslam::storage
