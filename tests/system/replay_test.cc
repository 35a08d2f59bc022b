#include <gtest/gtest.h>

#include <thread>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

void expect_same(const System& a, const System& b) {
  EXPECT_TRUE(identical(a.trajectories(), b.trajectories()));
  EXPECT_TRUE(identical(a.live_trajectories(), b.live_trajectories()));
  EXPECT_EQ(execution::journal_text(a.journal()), execution::journal_text(b.journal()));
}

// The recorded journal after conversion to text and back.
execution::Journal reread(const System& system) {
  auto journal = execution::parse_journal(execution::journal_text(system.journal()), "recorded");
  EXPECT_TRUE(journal.ok());
  return std::move(*journal);
}

TEST(SystemReplay, RepeatsAParallelRunExactly) {
  const RenderedTour& tour = rendered_tour(2, 14);
  for (int i = 0; i < 3; ++i) {
    Config config = small_config(execution::Mode::kParallel);
    config.tracking.keyframe.min_interval = 1;
    config.tracking.keyframe.min_overlap = 1.0;  // many keyframes, so that stages overlap
    System recorded(tour.rig(), config);
    for (const image::ImageBundle& images : tour.frames()) must_process(recorded, images);
    recorded.finish();
    System replayed(tour.rig(), config, {.replay = reread(recorded)});
    for (const image::ImageBundle& images : tour.frames()) must_process(replayed, images);
    replayed.finish();
    EXPECT_EQ(tracked_frames(replayed), tour.frames().size());
    expect_same(recorded, replayed);
  }
}

TEST(SystemReplay, RepeatsARunThatDiscardedAMapParallel) {
  const RenderedTour& tour = rendered_tour(1, 12);
  std::vector<image::ImageBundle> frames(tour.frames().begin(), tour.frames().begin() + 6);
  frames.push_back(tour.frames()[6]);
  mirror(frames.back().images[0]);
  for (std::size_t i = 0, first = frames.size(); i < tour.frames().size(); ++i)
    frames.push_back(tour.replayed(i, first));
  System recorded(tour.rig(), small_config(execution::Mode::kParallel));
  for (const image::ImageBundle& images : frames) must_process(recorded, images);
  recorded.finish();
  EXPECT_EQ(recorded.maps_started(), 2);
  System replayed(tour.rig(), small_config(execution::Mode::kParallel), {.replay = reread(recorded)});
  for (const image::ImageBundle& images : frames) must_process(replayed, images);
  replayed.finish();
  expect_same(recorded, replayed);
  MapVersion newest{0};
  for (const execution::JournalEntry& e : recorded.journal().entries) {  // version numbers continue across maps
    if (!e.committed) continue;
    EXPECT_EQ(*e.committed, newest.next());
    newest = *e.committed;
  }
}

TEST(SystemReplay, RejectsAJournalOfOtherOptions) {
  const RenderedTour& tour = rendered_tour(2, 10);
  System recorded(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : tour.frames()) must_process(recorded, images);
  recorded.finish();
  Config other = small_config(execution::Mode::kSequential);
  other.tracking.keyframe.min_interval = 1;
  other.tracking.keyframe.min_overlap = 1.0;
  System replayed(tour.rig(), other, {.replay = reread(recorded)});
  const auto replay = [&] {
    for (const image::ImageBundle& images : tour.frames()) must_process(replayed, images);
    replayed.finish();
  };
  EXPECT_THROW(replay(), execution::ReplayMismatch);

  Config without = small_config(execution::Mode::kSequential);
  without.final_adjustment = false;
  System shorter(tour.rig(), without, {.replay = reread(recorded)});
  for (const image::ImageBundle& images : tour.frames()) must_process(shorter, images);
  EXPECT_THROW(shorter.finish(), execution::ReplayMismatch);
}

TEST(SystemReplay, RepeatsAnInterruptedRunParallel) {
  const RenderedTour& tour = rendered_tour(2, 10);
  for (const execution::Mode mode :
       {execution::Mode::kSequential, execution::Mode::kParallel, execution::Mode::kLagged}) {
    System recorded(tour.rig(), small_config(mode));
    for (std::size_t k = 0; k < 7; ++k) must_process(recorded, tour.frames()[k]);
    std::jthread([&] { recorded.interrupt(); }).join();
    recorded.finish();
    for (const execution::JournalEntry& e : recorded.journal().entries)
      EXPECT_NE(e.step, execution::JournalStep::kFinal);
    EXPECT_EQ(final_poses(recorded).size(), 7u);
    System replayed(tour.rig(), small_config(mode), {.replay = reread(recorded)});
    for (std::size_t k = 0; k < 7; ++k) must_process(replayed, tour.frames()[k]);
    replayed.finish();
    expect_same(recorded, replayed);
    EXPECT_THROW(must_process(replayed, tour.frames()[7]), execution::ReplayMismatch);
  }
}

}  // namespace
}  // namespace bslam::system
