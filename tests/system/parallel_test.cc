#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

TEST(SystemParallel, TracksAllFramesAsWellAsSequential) {
  const RenderedTour tour(4, 16);
  System system(tour.rig(), small_config(Mode::kParallel));
  for (const image::ImageBundle& images : tour.frames()) system.process(images);
  system.finish();
  EXPECT_EQ(tracked_frames(system), tour.frames().size());
  EXPECT_LT(ate_m(system.trajectory(), tour.truth()), 0.01);
  EXPECT_LT(ate_m(system.live_trajectory(), tour.truth()), 0.015);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
  const auto keyframes = std::count_if(system.frames().begin(), system.frames().end(), [](const auto& r) { return r.keyframe; });
  EXPECT_LE(system.mapping_runs().size(), static_cast<std::size_t>(keyframes));
  EXPECT_GT(system.mapping_runs().size(), 0u);
}

TEST(SystemParallel, MayEndAtAnyFrameWithoutBeingFinished) {
  const RenderedTour tour(2, 12);
  for (std::size_t end = 0; end <= tour.frames().size(); ++end) {
    System system(tour.rig(), small_config(Mode::kParallel));
    for (std::size_t k = 0; k < end; ++k) system.process(tour.frames()[k]);
    EXPECT_EQ(system.frames().size(), end);
  }
}

TEST(SystemParallel, WaitsForAPendingKeyframeAtMost) {
  const RenderedTour tour(2, 12);
  Config config = small_config(Mode::kParallel);
  config.execution.pending_keyframes = 1;
  config.tracking.keyframe.min_interval = 1;
  config.tracking.keyframe.min_overlap = 1.0;  // a keyframe with every frame that lost one landmark
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) system.process(images);
  system.finish();
  EXPECT_EQ(tracked_frames(system), tour.frames().size());
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemParallel, VersionsOfTheMapStayWholeForReadersInOtherThreads) {
  const RenderedTour tour(2, 12);
  System system(tour.rig(), small_config(Mode::kParallel));
  system.process(tour.frames()[0]);
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
  for (std::size_t k = 1; k < tour.frames().size(); ++k) system.process(tour.frames()[k]);
  system.finish();
  done = true;
  reader.join();
  EXPECT_EQ(broken, 0);
}

TEST(SystemParallel, LeavesAYoungMapUpToScaleThatIsLost) {
  const RenderedTour tour(1, 12);
  System system(tour.rig(), small_config(Mode::kParallel));
  std::size_t k = 0;
  while (k < 8 && tracked_frames(system) == 0) system.process(tour.frames()[k++]);
  ASSERT_GT(tracked_frames(system), 0u);
  image::ImageBundle elsewhere = tour.frames()[k++];
  mirror(elsewhere.images[0]);
  system.process(elsewhere);
  EXPECT_EQ(tracked_frames(system), 0u);
  for (std::size_t i = 0; i < tour.frames().size(); ++i) system.process(tour.replayed(i, k));
  system.finish();
  EXPECT_EQ(system.maps_started(), 2);
  EXPECT_EQ(system.frames().size(), k + tour.frames().size());
}

// A store with one keyframe that shows nothing.
map::MapStore store_with_keyframe() {
  const auto rig = std::make_shared<const camera::Rig>(simulation::ring_rig(2, 320));
  map::BundledMap map(rig);
  auto frame = std::make_shared<frame::BundledFrame>();
  frame->cameras.resize(2);
  map.add_keyframe(std::move(frame), geometry::SE3(), {}, KeyframeId());
  return map::MapStore(std::move(map));
}

TEST(MappingExecutorParallel, BringsAWorkersExceptionToTheCaller) {
  map::MapStore store = store_with_keyframe();
  const Config config = small_config(Mode::kParallel);
  const auto executor =
      make_mapping_executor(store, config, [](KeyframeId, double) { throw std::runtime_error("worker failed"); });
  EXPECT_NO_THROW(executor->enqueue(KeyframeId(0)));
  EXPECT_THROW(executor->drain(), std::runtime_error);
  EXPECT_THROW(executor->enqueue(KeyframeId(0)), std::runtime_error);
  EXPECT_THROW(executor->drain(), std::runtime_error);
}

TEST(MappingExecutorParallel, MapsEveryKeyframeInOrderBeforeItIsDrained) {
  map::MapStore store = store_with_keyframe();
  Config config = small_config(Mode::kParallel);
  config.execution.pending_keyframes = 2;
  std::vector<KeyframeId> seen;  // the observer is called by one thread at a time, and by none after drain
  const auto executor = make_mapping_executor(store, config, [&](KeyframeId k, double) { seen.push_back(k); });
  for (int i = 0; i < 20; ++i) executor->enqueue(KeyframeId(0));
  executor->drain();
  EXPECT_EQ(seen.size(), 20u);
  EXPECT_GE(store.snapshot()->version(), MapVersion(20));
}

TEST(MappingExecutorSequential, ThrowsAtOnceAndIsDoneAtOnce) {
  map::MapStore store = store_with_keyframe();
  const Config config = small_config(Mode::kSequential);
  int runs = 0;
  const auto executor = make_mapping_executor(store, config, [&](KeyframeId, double) {
    if (++runs == 2) throw std::runtime_error("failed");
  });
  executor->enqueue(KeyframeId(0));
  EXPECT_EQ(runs, 1);
  EXPECT_THROW(executor->enqueue(KeyframeId(0)), std::runtime_error);
}

}  // namespace
}  // namespace bslam::system
