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
  // An estimate of the times of camera 1; a deviation of 0 stands for a time that was not refined.
  RigRefinement with_times(double offset_ms, double offset_std_ms, double readout_ms, double readout_std_ms) const {
    RigRefinement out = estimate(0, 1);
    solver::RigValues values = solver::RigValues::of(rig);
    values.timing[1] = {1e-3 * offset_ms, 1e-3 * readout_ms};
    out.rig = values.applied_to(rig);
    out.cameras.resize(2);
    out.cameras[1].observations = 1000;
    out.cameras[1].time_offset = {offset_ms, offset_std_ms, offset_std_ms > 0};
    out.cameras[1].readout = {readout_ms, readout_std_ms, readout_std_ms > 0};
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

// A recording of slow motion does not show the times that one of fast motion shows, whichever comes first.
TEST(JointRefinement, TakesTimesFromTheRecordingsThatShowThem) {
  const Pair pair;
  const RigRefinement fast = pair.with_times(20, 0.1, 30, 0.2), slow = pair.with_times(0, 0, 0, 0);
  for (const auto& recordings : {std::vector{fast, slow}, std::vector{slow, fast}, std::vector{fast}}) {
    const auto joint = combine(pair.rig, recordings);
    ASSERT_TRUE(joint.has_value());
    EXPECT_EQ(joint->rig.camera(1u).time_offset_ns, 20'000'000);
    EXPECT_EQ(joint->rig.camera(1u).readout_s, 0.03);
    EXPECT_EQ(joint->rig.camera(0u).time_offset_ns, 0);
  }
  const auto joint = combine(pair.rig, std::vector{fast, pair.with_times(23, 0.2, 0, 0)});
  ASSERT_TRUE(joint.has_value());
  EXPECT_NEAR(to_seconds(joint->rig.camera(1u).time_offset_ns), (4 * 0.020 + 0.023) / 5, 1e-9);
  EXPECT_EQ(joint->rig.camera(1u).readout_s, 0.03);
  const auto neither = combine(pair.rig, std::vector{slow, slow});
  ASSERT_TRUE(neither.has_value());
  EXPECT_EQ(neither->rig.camera(1u).time_offset_ns, 0);
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
