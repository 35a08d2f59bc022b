#include <gtest/gtest.h>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

TEST(SystemLagged, IsDeterministicWithAnyNumberOfThreads) {
  const RenderedTour& tour = rendered_tour(4, 16);
  evaluation::Trajectory final, live;
  std::string journal;
  for (const int threads : {1, 1, 2, 4}) {
    System system(tour.rig(), small_config(execution::Mode::kLagged, threads));
    for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
    system.finish();
    EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
    EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
    if (journal.empty()) {
      final = final_poses(system);
      live = live_poses(system);
      journal = execution::journal_text(system.journal());
      EXPECT_EQ(final.size(), tour.frames().size());
    }
    EXPECT_TRUE(identical(final, final_poses(system))) << threads << " threads";
    EXPECT_TRUE(identical(live, live_poses(system))) << threads << " threads";
    EXPECT_EQ(execution::journal_text(system.journal()), journal) << threads << " threads";
  }
}

TEST(SystemLagged, CanBeDestroyedAtAnyFrameParallel) {
  const RenderedTour& tour = rendered_tour(2, 12);
  for (std::size_t end = 0; end <= tour.frames().size(); ++end) {
    System system(tour.rig(), small_config(execution::Mode::kLagged));
    for (std::size_t k = 0; k < end; ++k) must_process(system, tour.frames()[k]);
    EXPECT_EQ(system.frames().size(), end);
  }
}

}  // namespace
}  // namespace bslam::system
