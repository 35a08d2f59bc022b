// A frame that could not be tracked is relocalised; the attempt to track it must not change the result.
#include <gtest/gtest.h>

#include "looping/verify_place.h"
#include "tracking/simulated_tracker.h"

namespace bslam::system {
namespace {

// Images with smooth random texture, unrelated to the landmarks' patches.
std::vector<image::Pyramid> textured_pyramids(const camera::Rig& rig) {
  Random random(3, "texture");
  std::vector<image::Pyramid> out(rig.size());
  for (std::size_t c = 0; c < rig.size(); ++c) {
    image::Image image(rig.camera(c).width, rig.camera(c).height);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double wave = std::sin(0.31 * x + 0.05 * y) + std::sin(0.27 * y - 0.11 * x);
        image.row(y)[x] = static_cast<std::uint8_t>(128 + 50 * wave + random.uniform(0, 5));
      }
    }
    image::build_pyramid(image.view(), 8, 1.2, out[c]);
  }
  return out;
}

int matched(const tracking::TrackResult& result) {
  int sum = 0;
  for (const tracking::CameraCounts& c : result.cameras) sum += c.matched;
  return sum;
}

class LostFrame : public ::testing::Test {
 protected:
  tracking::TrackOutput track(const frame::BundledFrame& frame, int min_inliers) {
    // Accepts any alignment, so that most keypoints move to wrong positions.
    const std::vector<matching::AlignmentOptions> alignment(
        pyramids.size(), {.iterations = 50, .max_shift_px = 10, .min_ncc = -1, .calibration_error_px = 0.01});
    tracking::TrackingOptions options;
    options.min_inlier_ratio = 0;
    options.min_inliers = min_inliers;
    const tracking::TrackerState state = tracking::state_at_first(world);
    const tracking::TrackInput input{.map = world.map,
                                     .pyramids = pyramids,
                                     .alignment = alignment,
                                     .state = state,
                                     .features = {.sigma_px = world.sim.options().sigma_px}};
    ThreadPool pool(2);
    return tracking::track(input, frame, options, pool);
  }
  std::optional<looping::PlaceMatch> verify_place(const frame::BundledFrame& frame) const {
    return looping::verify_place(world.map, world.map.rig(), frame, KeyframeId(0), {},
                                 {.sigma_px = world.sim.options().sigma_px}, Random(1, "locate"));
  }

  const map::SimulatedMap world = tracking::true_map(tracking::simulator(synthetic::ring_rig(2)), 1.0, 0.25);
  const std::vector<image::Pyramid> pyramids = textured_pyramids(world.map.rig());
};

TEST_F(LostFrame, IsRelocalisedLikeAFrameThatWasNotTracked) {
  const frame::BundledFrame tried = world.sim.frame(FrameId(1), 0.05).frame;
  const frame::BundledFrame fresh = world.sim.frame(FrameId(1), 0.05).frame;
  const int num_matches = matched(track(fresh, 10).result);
  ASSERT_GT(num_matches, 100);
  const tracking::TrackOutput lost = track(tried, num_matches * 4 / 5);
  ASSERT_EQ(lost.result.status, tracking::TrackStatus::kLost);
  ASSERT_TRUE(lost.result.reason == tracking::LostReason::kUnstablePose ||
              lost.result.reason == tracking::LostReason::kFewInliers)
      << describe(lost.result.reason);  // after keypoints were aligned

  EXPECT_EQ(tried.twist, fresh.twist);
  for (std::size_t c = 0; c < fresh.cameras.size(); ++c) {
    const feature::Keypoints &a = tried.cameras[c].keypoints, &b = fresh.cameras[c].keypoints;
    EXPECT_TRUE(a.pixel == b.pixel && a.bearing == b.bearing && a.sigma == b.sigma && a.patch == b.patch);
  }
  const auto found = verify_place(tried), expected = verify_place(fresh);
  ASSERT_TRUE(found && expected);
  EXPECT_EQ(found->matches, expected->matches);
  EXPECT_EQ(found->inliers, expected->inliers);
  EXPECT_EQ(found->T_rig_world.translation(), expected->T_rig_world.translation());
  EXPECT_EQ(found->T_rig_world.rotation().coeffs(), expected->T_rig_world.rotation().coeffs());
}

// Shows that the test above is effective: with a tracked frame the keypoints move.
TEST_F(LostFrame, WouldHaveDifferentKeypointsIfTracked) {
  const frame::BundledFrame frame = world.sim.frame(FrameId(1), 0.05).frame;
  const tracking::TrackOutput out = track(frame, 10);
  ASSERT_EQ(out.result.status, tracking::TrackStatus::kTracking) << describe(out.result.reason);
  std::size_t moved = 0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    for (std::size_t k = 0; k < frame.cameras[c].keypoints.size(); ++k) {
      moved += frame.cameras[c].keypoints.pixel[k] != out.frame.cameras[c].keypoints.pixel[k];
    }
  }
  EXPECT_GT(moved, 20u);
}

}  // namespace
}  // namespace bslam::system
