#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

TEST(SystemParallel, TracksAllFramesAsWellAsSequential) {
  const RenderedTour& tour = rendered_tour(4, 16);
  System system(tour.rig(), small_config(execution::Mode::kParallel));
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  EXPECT_EQ(tracked_frames(system), tour.frames().size());
  EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
  EXPECT_LT(ate_m(live_poses(system), tour.truth()), 0.015);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
  const auto keyframes =
      std::count_if(system.frames().begin(), system.frames().end(), [](const auto& r) { return r.keyframe; });
  std::size_t mapped = 0;
  for (const StageRecord& stage : system.stage_runs()) mapped += stage.run.task.stage == execution::Stage::kMap;
  EXPECT_LE(mapped, static_cast<std::size_t>(keyframes));
  EXPECT_GT(mapped, 0u);
}

TEST(SystemParallel, CanBeDestroyedAtAnyFrame) {
  const RenderedTour& tour = rendered_tour(2, 12);
  for (std::size_t end = 0; end <= tour.frames().size(); ++end) {
    System system(tour.rig(), small_config(execution::Mode::kParallel));
    for (std::size_t k = 0; k < end; ++k) must_process(system, tour.frames()[k]);
    EXPECT_EQ(system.frames().size(), end);
  }
}

TEST(SystemParallel, WaitsAtMostForAPendingKeyframe) {
  const RenderedTour& tour = rendered_tour(2, 12);
  Config config = small_config(execution::Mode::kParallel);
  config.execution.max_pending_keyframes = 1;
  config.tracking.keyframe.min_interval = 1;
  config.tracking.keyframe.min_overlap = 1.0;  // a keyframe if a single landmark is lost
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  EXPECT_EQ(tracked_frames(system), tour.frames().size());
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemParallel, VersionsOfTheMapAreConsistentForReadersInOtherThreads) {
  const RenderedTour& tour = rendered_tour(2, 12);
  System system(tour.rig(), small_config(execution::Mode::kParallel));
  must_process(system, tour.frames()[0]);
  std::atomic<bool> done = false;
  std::atomic<int> broken = 0;
  std::thread reader([&] {
    MapVersion last{0};
    while (!done) {
      const map::MapSnapshot map = system.snapshot();
      broken += map->check_invariants().has_value() || map->version() < last;
      last = map->version();
    }
  });
  for (std::size_t k = 1; k < tour.frames().size(); ++k) must_process(system, tour.frames()[k]);
  system.finish();
  done = true;
  reader.join();
  EXPECT_EQ(broken, 0);
}

TEST(SystemParallel, DiscardsANewMapUpToScaleThatIsLost) {
  const RenderedTour& tour = rendered_tour(1, 12);
  System system(tour.rig(), small_config(execution::Mode::kParallel));
  std::size_t k = 0;
  while (k < 8 && tracked_frames(system) == 0) must_process(system, tour.frames()[k++]);
  ASSERT_GT(tracked_frames(system), 0u);
  image::ImageBundle elsewhere = tour.frames()[k++];
  mirror(elsewhere.images[0]);
  must_process(system, elsewhere);
  EXPECT_EQ(tracked_frames(system), 0u);
  for (std::size_t i = 0; i < tour.frames().size(); ++i) must_process(system, tour.replayed(i, k));
  system.finish();
  EXPECT_EQ(system.maps_started(), 2);
  EXPECT_EQ(system.frames().size(), k + tour.frames().size());
}

}  // namespace
}  // namespace bslam::system
