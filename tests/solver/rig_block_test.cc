#include "solver/rig_block.h"

#include <gtest/gtest.h>

namespace bslam::solver {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

TEST(ExtrinsicPrior, TranslationsAreLessCertainAlongTheOpticalAxes) {
  const SE3 T_side_cam0(Eigen::AngleAxisd(geometry::radians(120), Vector3d::Ones().normalized()).toRotationMatrix(),
                        Vector3d(0.1, 0, 0));
  const ExtrinsicPrior prior{.T_cam_rig = {SE3(), SE3(Eigen::Matrix3d::Identity(), Vector3d(-0.1, 0, 0)), T_side_cam0},
                             .sigma_rotation = 0.1,
                             .sigma_translation = 3,
                             .sigma_depth = 4};
  const Vector6d parallel = (Vector6d() << 0.01, 0.01, 0.01, 9, 9, 9 + 2 * 16).finished(),
                 side = (Vector6d() << 0.01, 0.01, 0.01, 9 + 16, 9, 9 + 16).finished();  // z of camera 0 is its x
  EXPECT_LT((covariance_of(prior, 1) - Matrix6d(parallel.asDiagonal())).norm(), 1e-12);
  EXPECT_LT((covariance_of(prior, 2) - Matrix6d(side.asDiagonal())).norm(), 1e-12);
}

}  // namespace
}  // namespace bslam::solver
