// Rough rigs before a map is started.
#include "tracking/start_correction.h"

#include <gtest/gtest.h>

#include "geometry/so3.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;
using geometry::Vector3d;

double focal_length(const camera::Camera& camera) { return camera::intrinsics(camera.model).fx; }

// Focal lengths multiplied by `factors`, the last camera turned by 3 degrees and moved by 2 cm.
camera::Rig rough(const camera::Rig& rig, const std::vector<double>& factors) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    camera::RigCamera camera{camera::zoomed(rig.camera(c), factors[c]), rig.body_from_cam(c)};
    if (c + 1 == rig.size()) {
      const SE3 error(geometry::so3_exp(3.0 * kDegree * Vector3d(0.6, -0.5, 0.62).normalized()),
                      Vector3d(0.012, 0.006, 0.014));
      camera.T_body_cam = camera.T_body_cam * error;
    }
    cameras.push_back(std::move(camera));
  }
  return camera::Rig(std::move(cameras));
}

// Ratio of the focal lengths of cameras 1 and 0, relative to the true one.
double focal_ratio(const camera::Rig& rig, const camera::Rig& truth) {
  const auto ratio = [](const camera::Rig& r) { return focal_length(r.camera(1)) / focal_length(r.camera(0)); };
  return ratio(rig) / ratio(truth);
}

double rotation_error_deg(const camera::Rig& rig, const camera::Rig& truth) {
  const auto relative = [](const camera::Rig& r) { return r.cam_from_rig(1) * r.rig_from_cam(0); };
  return relative(rig).rotation().angularDistance(relative(truth).rotation()) / kDegree;
}

class StartCorrection : public ::testing::TestWithParam<int> {
 protected:
  static camera::Rig true_rig() {
    if (GetParam() == 0) return synthetic::ring_rig(2);
    return synthetic::mixed_rig().subset(std::vector<int>{0, 2});  // a pinhole and a fisheye
  }
};

TEST(StartCorrectionOfRoughRig, FindsTheRatioOfFocalLengths) {
  const camera::Rig truth = synthetic::ring_rig(2);
  const frame::BundledFrame frame = simulator(truth).frame(FrameId(1), 0.5).frame;
  for (const std::vector<double>& factors : {std::vector<double>{0.92, 1.08}, {1.08, 0.92}, {1.0, 1.0}}) {
    const camera::Rig given = rough(truth, factors);
    const auto corrected = with_corrected_pairs(given, given, 0.1, frame);
    ASSERT_TRUE(corrected) << factors[1];
    EXPECT_NEAR(focal_ratio(*corrected, truth), 1.0, 0.02) << factors[1];
    EXPECT_EQ(focal_length(corrected->camera(0)), focal_length(given.camera(0)));
    EXPECT_LT(rotation_error_deg(*corrected, truth), 2.0) << factors[1];
    const bool known = factors[0] == factors[1];
    EXPECT_EQ(with_corrected_pairs(given, given, 0.01, frame).has_value(), known) << factors[1];
  }
}

TEST_P(StartCorrection, KeepsFocalLengthsThatAreKnown) {
  const camera::Rig truth = true_rig();
  const frame::BundledFrame frame = simulator(truth).frame(FrameId(1), 0.5).frame;
  const camera::Rig given = rough(truth, {1.0, 1.0});
  const auto corrected = with_corrected_pairs(given, given, 0.01, frame);
  ASSERT_TRUE(corrected);
  EXPECT_EQ(focal_length(corrected->camera(1)), focal_length(truth.camera(1)));
  EXPECT_LT(rotation_error_deg(*corrected, truth), 1.0);
  EXPECT_FALSE(with_corrected_pairs(truth, truth, 0.1, frame)) << "nothing to correct";
}

INSTANTIATE_TEST_SUITE_P(Cameras, StartCorrection, ::testing::Values(0, 1));

}  // namespace
}  // namespace bslam::tracking
