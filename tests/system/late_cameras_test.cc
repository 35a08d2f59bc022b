#include <gtest/gtest.h>

#include "base/median.h"
#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

using geometry::SE3;

constexpr std::size_t kFrames = 40;
constexpr TimeNs kLate = 40'000'000;

const RenderedTour& tour() {
  static const RenderedTour tour(4, kFrames, kLate);
  return tour;
}

void play(System& system) {
  for (const image::ImageBundle& images : tour().frames()) must_process(system, images);
  system.finish();
}

// Error of the poses of late cameras in the map relative to camera 0 at the time of the keyframe; sum of m and rad.
double motion_error(const map::BundledMap& map) {
  std::vector<double> errors;
  for (const KeyframeId k : map.keyframe_ids()) {
    const auto frame = static_cast<std::size_t>(map.keyframe(k).frame->id.value());
    if (frame == 0) continue;  // has no motion yet
    const SE3 true_motion = tour().rig_truth(2)[frame].T_world_frame.inverse() * tour().truth()[frame].T_world_frame;
    errors.push_back((map.motion_until(k, CameraIndex(2)) * true_motion.inverse()).log().norm());
  }
  return median(std::move(errors));
}

TEST(LateCameras, PosesFollowTheAdjacentFrames) {
  Config live = small_config(execution::Mode::kSequential);
  live.final_adjustment = false;
  System before(tour().rig(), live);
  play(before);
  System after(tour().rig(), small_config(execution::Mode::kSequential));
  play(after);
  const double tracked = motion_error(*before.snapshot()), known = motion_error(*after.snapshot());
  std::printf("motion of late cameras: %.2f mm from the frames before, %.2f mm from those on both sides\n",
              1e3 * tracked, 1e3 * known);
  EXPECT_LT(known, 0.8 * tracked);
  EXPECT_EQ(after.snapshot()->check_invariants(), std::nullopt);
}

TEST(LateCameras, PosesOfAnEarlierRunAreKept) {
  System first(tour().rig(), small_config(execution::Mode::kSequential));
  play(first);
  const map::MapSnapshot saved = first.snapshot();
  Resources resources;
  resources.map = *saved;
  System second(tour().rig(), small_config(execution::Mode::kSequential), std::move(resources));
  play(second);  // frames with the same ids and times
  for (const KeyframeId k : saved->keyframe_ids()) {
    if (!second.snapshot()->alive(k)) continue;
    EXPECT_EQ(second.snapshot()->keyframe(k).twist, saved->keyframe(k).twist);
  }
}

}  // namespace
}  // namespace bslam::system
