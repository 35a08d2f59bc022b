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

// It may be far from where it was, which the baselines of two cameras do not show.
TEST(ExtrinsicPrior, TheTranslationOfACameraAfterAMoveIsTenTimesLessCertain) {
  const SE3 T_second_rig(Eigen::Quaterniond::Identity(), Vector3d(-0.1, 0, 0));
  const ExtrinsicPrior prior{.T_cam_rig = {SE3(), T_second_rig, T_second_rig},
                             .sigma_rotation = 0.1,
                             .sigma_translation = 3,
                             .with_baseline = 2};
  const Vector6d still = (Vector6d() << 0.01, 0.01, 0.01, 9, 9, 9).finished(),
                 moved = (Vector6d() << 0.01, 0.01, 0.01, 900, 900, 900).finished();
  EXPECT_LT((covariance_of(prior, 1) - Matrix6d(still.asDiagonal())).norm(), 1e-12);
  EXPECT_LT((covariance_of(prior, 2) - Matrix6d(moved.asDiagonal())).norm(), 1e-9);
  EXPECT_EQ(displaced_cameras(prior.T_cam_rig, prior), (std::vector<std::uint8_t>{0, 0, 0}));
}

// Poses of cameras with the same centre, which is not the origin of the body frame, differ by rounding errors.
TEST(ExtrinsicPrior, CamerasAtOnePlaceHaveNoBaseline) {
  const SE3 at_1_nm(Eigen::Quaterniond::Identity(), Vector3d(1e-9, 0, 0)),
      apart(Eigen::Quaterniond::Identity(), Vector3d(0, 0.1, 0));
  EXPECT_EQ(baseline_weights({.T_cam_rig = {SE3(), at_1_nm}, .sigma_translation = 0.005}), (std::vector<double>{0, 0}));
  const std::vector<double> weights =
      baseline_weights({.T_cam_rig = {SE3(), at_1_nm, apart}, .sigma_translation = 0.005});
  EXPECT_EQ(weights[1], 0);
  EXPECT_NEAR(weights[2], 100, 1e-9);
}

}  // namespace
}  // namespace bslam::solver
