#include "geometry/up_axis.h"

#include <gtest/gtest.h>

#include <vector>

namespace bslam::geometry {
namespace {

TEST(UpAxis, IsAnAxisOfBodyCameraOrWorld) {
  EXPECT_EQ(parse_up_axis("body:z").value().direction, Vector3d::UnitZ());
  EXPECT_EQ(parse_up_axis("camera:-y").value().direction, Vector3d(0, -1, 0));
  EXPECT_EQ(parse_up_axis("world:0,-3,4").value().direction, Vector3d(0, -0.6, 0.8));
  for (const char* wrong : {"", "z", "body", "body:", "body:w", "sky:z", "world:1,2", "world:0,0,0", "world:1,nan,2",
                            "world:1,2,3,4", "body:--z", "world:1e308,1e308,1e308x"})
    EXPECT_FALSE(parse_up_axis(wrong)) << wrong;
}

// A camera that is mounted rolled by 34 degrees on a level body that turns about its x axis, which is vertical.
TEST(UpAxis, OfTheBodyIsTheVerticalHoweverTheCameraIsMounted) {
  const SE3 T_body_cam(so3_exp({0.3, 0.1, 0.6}), Vector3d(0.1, 0, 0));
  std::vector<SE3> poses;
  for (int i = 0; i < 30; ++i) poses.push_back(SE3(so3_exp({0.2 * i, 0, 0}), Vector3d(0, i, 0)) * T_body_cam);
  const auto up = up_in_world(parse_up_axis("body:x").value(), poses, T_body_cam);
  ASSERT_TRUE(up);
  EXPECT_LT((*up - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_FALSE(up_in_world(parse_up_axis("body:y").value(), poses, T_body_cam));  // it points everywhere
}

}  // namespace
}  // namespace bslam::geometry
