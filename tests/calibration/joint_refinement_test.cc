#include "calibration/joint_refinement.h"

#include <gtest/gtest.h>

#include <cmath>

#include "synthetic/rigs.h"

namespace bslam::calibration {
namespace {

constexpr int kPinhole = 4;

// A rig of two cameras and an estimate with independent deviations: `change` in every value, the prior's deviation 1.
struct Pair {
  camera::Rig rig = synthetic::ring_rig(2, 240);
  Eigen::Index size = 0;
  Pair() {
    size = 6;
    for (std::size_t c = 0; c < rig.size(); ++c) size += camera::parameters(rig.camera(c).model).size();
  }
  RigRefinement estimate(double change, double std) const {
    RigRefinement out;
    out.done = true;
    out.information.change = Eigen::VectorXd::Constant(size, change);
    out.information.prior = Eigen::MatrixXd::Identity(size, size);
    out.information.information = Eigen::MatrixXd::Identity(size, size) / (std * std);
    return out;
  }
};

TEST(JointRefinement, OfOneEstimateIsThatEstimate) {
  const Pair pair;
  const RigRefinement one = pair.estimate(1e-3, 1e-2);
  const auto joint = combine(pair.rig, std::vector{one});
  ASSERT_TRUE(joint.has_value());
  const geometry::Vector6d moved = solver::extrinsic_change(joint->rig.cam_from_rig(1), pair.rig.cam_from_rig(1));
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(moved(k), 1e-3, 1e-12);
  for (std::size_t c = 0; c < 2; ++c) {
    const camera::ModelParameters change =
        camera::parameters(joint->rig.camera(c).model) - camera::parameters(pair.rig.camera(c).model);
    for (int k = 0; k < kPinhole; ++k) EXPECT_NEAR(change(k), 1e-3, 1e-9);
    for (const CalibratedValue& value : joint->cameras[c].intrinsics) {
      EXPECT_NEAR(value.std, 1e-2, 1e-9);
      EXPECT_TRUE(value.observed);
    }
  }
}

TEST(JointRefinement, WeighsEstimatesByTheirInformation) {
  const Pair pair;
  const auto joint = combine(pair.rig, std::vector{pair.estimate(0, 0.01), pair.estimate(0.03, 0.02)});
  ASSERT_TRUE(joint.has_value());
  const CalibratedValue& value = joint->cameras[1].extrinsics[4];
  // The information of both, in which the prior counts once.
  EXPECT_NEAR(value.change, 0.03 * 2500 / (1e4 + 2500 - 1), 1e-9);
  EXPECT_NEAR(value.std, 1 / std::sqrt(1e4 + 2500 - 1), 1e-9);
}

TEST(JointRefinement, ManyRecordingsOutweighThePrior) {
  const Pair pair;
  // The images of each have as much information as the prior, so that each estimate is half of the true change of 0.1.
  const double std = std::sqrt(0.5);
  const auto joint = combine(pair.rig, std::vector(9, pair.estimate(0.05, std)));
  ASSERT_TRUE(joint.has_value());
  EXPECT_NEAR(joint->cameras[1].extrinsics[4].change, 0.1 * 9 / 10, 1e-9);
  EXPECT_NEAR(joint->cameras[1].extrinsics[4].std, std::sqrt(1.0 / 10), 1e-9);
}

TEST(JointRefinement, WithoutInformationTheValuesAreNotObserved) {
  const Pair pair;
  const auto joint = combine(pair.rig, std::vector{pair.estimate(0, 1), pair.estimate(0, 1), pair.estimate(0, 1)});
  ASSERT_TRUE(joint.has_value());
  EXPECT_NEAR(joint->cameras[1].extrinsics[0].std, 1, 1e-9);
  EXPECT_FALSE(joint->cameras[1].extrinsics[0].observed);
  EXPECT_FALSE(joint->cameras[0].intrinsics[0].observed);
}

}  // namespace
}  // namespace bslam::calibration
