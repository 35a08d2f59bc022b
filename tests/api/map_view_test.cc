#include <bslam/map_view.h>
#include <gtest/gtest.h>

#include "storage/small_map.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam {
namespace {

using geometry::SE3;

class PublicMapView : public ::testing::Test {
 protected:
  MapView view_of(const map::BundledMap& map) {
    const auto file = folder_.path() / "map.bmap";
    EXPECT_TRUE(storage::write_map(map, {}, file));
    return MapView::load(file).value();
  }

  const support::TemporaryFolder folder_;
};

void expect_near(const Pose& a, const Pose& b) {
  const Matrix4 left = a.matrix(), right = b.matrix();
  for (std::size_t i = 0; i < left.size(); ++i) EXPECT_NEAR(left[i], right[i], 1e-9) << i;
}

// A refinement of the calibration has turned camera 0 in the body.
TEST_F(PublicMapView, PosesOfKeyframesBelongToItsRig) {
  map::BundledMap map = storage::small_map(synthetic::ring_rig(2));
  const MapView before = view_of(map);
  const SE3 T_cam0_rig(geometry::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY())), {0, 0, 0});
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < 2; ++c) cameras.push_back({map.rig().camera(c), map.rig().body_from_cam(c)});
  cameras[0].T_body_cam = cameras[0].T_body_cam * T_cam0_rig.inverse();
  map.set_rig(std::make_shared<const camera::Rig>(cameras, T_cam0_rig));
  const MapView after = view_of(map);
  const auto old_keyframes = before.keyframes(), keyframes = after.keyframes();
  ASSERT_EQ(keyframes.size(), old_keyframes.size());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    expect_near(keyframes[k].T_world_body, old_keyframes[k].T_world_body);
    expect_near(keyframes[k].T_world_body * after.rig().camera(0).T_body_cam, keyframes[k].T_world_cam0);
    EXPECT_GT(std::abs((keyframes[k].T_world_cam0.inverse() * old_keyframes[k].T_world_cam0).rotation[1]), 0.009);
  }
}

// The file of the mask need not exist where the map is read.
TEST_F(PublicMapView, ItsRigHasNoMasks) {
  const camera::Rig rig = synthetic::ring_rig(2);
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < 2; ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  cameras[0].camera.mask_file = "/no/such/folder/mask.png";
  const MapView view = view_of(storage::small_map(camera::Rig(cameras)));
  ASSERT_TRUE(view.rig().save(folder_.path() / "rig.yaml"));
  const auto again = Rig::load(folder_.path() / "rig.yaml");
  ASSERT_TRUE(again) << again.error().message();
}

}  // namespace
}  // namespace bslam
