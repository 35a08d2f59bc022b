#include <gtest/gtest.h>

#include <array>

#include "adjustment/robust_cost.h"
#include "mapping/local_adjustment.h"
#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

using image::ImageState;
using tracking::LostReason;
using tracking::TrackStatus;

struct Outcome {
  evaluation::Trajectory final, live;
  std::size_t landmarks = 0, observations = 0;
};

Outcome run(const RenderedTour& tour, const Config& config) {
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  return {final_poses(system), live_poses(system), system.snapshot()->num_landmarks(),
          system.snapshot()->num_observations()};
}

TEST(SystemSequential, IsDeterministicWithAnyNumberOfThreads) {
  const RenderedTour& tour = rendered_tour(4, 16);
  const Outcome first = run(tour, small_config(execution::Mode::kSequential, 1));
  EXPECT_EQ(first.final.size(), tour.frames().size());
  for (const int threads : {1, 2, 4}) {
    const Outcome again = run(tour, small_config(execution::Mode::kSequential, threads));
    EXPECT_TRUE(identical(first.final, again.final)) << threads << " threads";
    EXPECT_TRUE(identical(first.live, again.live)) << threads << " threads";
    EXPECT_EQ(first.landmarks, again.landmarks);
    EXPECT_EQ(first.observations, again.observations);
  }
}

TEST(SystemSequential, TracksWithOneToEightCameras) {
  const std::size_t count = 20;
  const RenderedTour& tour = rendered_tour(8, count);
  for (int n = 1; n <= 8; ++n) {
    System system(tour.rig_of(n), small_config(execution::Mode::kSequential));
    for (std::size_t k = 0; k < count; ++k) must_process(system, tour.frame_of(k, n));
    system.finish();
    const auto align = n == 1 ? evaluation::AlignMode::kSim3 : evaluation::AlignMode::kSe3;
    EXPECT_EQ(system.snapshot()->scale(), n == 1 ? map::Scale::kUpToScale : map::Scale::kMetric) << n << " cameras";
    EXPECT_GE(tracked_frames(system), n == 1 ? count - 5 : count) << n << " cameras";  // two views must have parallax
    EXPECT_LT(ate_m(final_poses(system), tour.truth(), align), 0.01) << n << " cameras";
    EXPECT_LT(ate_m(live_poses(system), tour.truth(), align), 0.015) << n << " cameras";
    EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt) << n << " cameras";
  }
}

TEST(SystemSequential, EstimatesTheTruePathLengthWithTwoCameras) {
  const RenderedTour& tour = rendered_tour(2, 24);
  const Outcome outcome = run(tour, small_config(execution::Mode::kSequential));
  const double truth_m = evaluation::path_length_m(tour.truth());
  EXPECT_NEAR(evaluation::path_length_m(outcome.final), truth_m, 0.03 * truth_m);
}

TEST(SystemSequential, ADamagedOrMissingImageAffectsOnlyItsCamera) {
  const RenderedTour& tour = rendered_tour(4, 16);
  std::vector<image::ImageBundle> frames = tour.frames();
  make_absent(frames[6].images[1], ImageState::kDamaged);
  for (const std::size_t k : {8u, 9u}) make_absent(frames[k].images[0], ImageState::kMissing);
  make_absent(frames[11].images[0], ImageState::kDamaged);
  make_absent(frames[11].images[1], ImageState::kDamaged);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : frames) {
    const FrameRecord record = must_process(system, images);
    EXPECT_EQ(record.result.status, TrackStatus::kTracking) << "frame " << images.id.value();
    for (std::size_t c = 0; c < 4; ++c) {
      const bool present = images.images[c].state == ImageState::kPresent;
      EXPECT_EQ(record.images[c], images.images[c].state);
      EXPECT_EQ(record.result.cameras[c].keypoints > 0, present);
      EXPECT_EQ(record.result.cameras[c].inliers > 0, present && images.id.value() > 0)
          << "frame " << images.id.value();
    }
  }
  system.finish();
  EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemSequential, IsLostInTheDarkAndRecovers) {
  const RenderedTour& tour = rendered_tour(2, 20);
  std::vector<image::ImageBundle> frames = tour.frames();
  for (const std::size_t k : {8u, 9u}) {
    for (image::CameraImage& i : frames[k].images) blacken(i);
  }
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : frames) {
    const FrameRecord record = must_process(system, images);
    const bool dark = images.id.value() == 8 || images.id.value() == 9;
    EXPECT_EQ(record.result.status, dark ? TrackStatus::kLost : TrackStatus::kTracking)
        << "frame " << images.id.value();
    EXPECT_EQ(record.result.reason, dark ? LostReason::kNoImages : LostReason::kNone);
    const tracking::CameraStatus status =
        dark ? tracking::CameraStatus{tracking::CameraState::kOut, tracking::CameraReason::kBlack}
             : tracking::CameraStatus{};
    EXPECT_EQ(record.cameras, std::vector<tracking::CameraStatus>(2, status)) << "frame " << images.id.value();
  }
  system.finish();
  EXPECT_EQ(final_poses(system).size(), frames.size() - 2);
  EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
  EXPECT_EQ(system.maps_started(), 1);
}

TEST(SystemSequential, RecordsEveryInputFrame) {
  const RenderedTour& tour = rendered_tour(2, 10);
  std::vector<image::ImageBundle> frames = tour.frames();
  for (const std::size_t k : {0u, 6u}) {
    for (image::CameraImage& i : frames[k].images) make_absent(i, ImageState::kMissing);
  }
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : frames) must_process(system, images);
  system.finish();
  ASSERT_EQ(system.frames().size(), frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const FrameRecord& record = system.frames()[k];
    EXPECT_EQ(record.result.frame, frames[k].id);
    EXPECT_EQ(record.result.time_ns, frames[k].time_ns);
    EXPECT_EQ(record.images.size(), 2u);
    EXPECT_EQ(record.result.cameras.size(), 2u);
    EXPECT_EQ(record.unique, record.monocular + record.matched);
    EXPECT_EQ(record.result.status == TrackStatus::kTracking, record.result.reason == LostReason::kNone);
    int inliers = 0;
    for (const tracking::CameraCounts& c : record.result.cameras) {
      EXPECT_LE(c.inliers, c.matched);
      EXPECT_LE(c.matched, c.keypoints);
      inliers += c.inliers;
    }
    if (k > 1 && k != 6) {
      EXPECT_GE(inliers, 30) << "frame " << k;
    }
  }
  EXPECT_EQ(system.frames()[0].result.reason, LostReason::kNotStarted);
  EXPECT_EQ(system.frames()[6].result.reason, LostReason::kNoImages);
  EXPECT_TRUE(system.frames()[1].keyframe);
  const auto runs = system.stage_runs();
  EXPECT_EQ(
      std::ranges::count_if(runs, [](const StageRecord& r) { return r.run.task.stage == execution::Stage::kMap; }),
      std::ranges::count_if(system.frames(), [](const FrameRecord& r) { return r.keyframe; }));
}

TEST(SystemSequential, UsesOnlyUnmaskedPixels) {
  const RenderedTour& tour = rendered_tour(2, 4);
  image::Image nothing(tour.rig().camera(1).width, tour.rig().camera(1).height);
  image::CameraImage black{ImageState::kPresent, 0, nothing};
  blacken(black);
  System system(tour.rig(), small_config(execution::Mode::kSequential), {.masks = {image::Image(), black.image}});
  for (const image::ImageBundle& images : tour.frames()) {
    const FrameRecord record = must_process(system, images);
    EXPECT_GT(record.result.cameras[0].keypoints, 100);
    EXPECT_EQ(record.result.cameras[1].keypoints, 0);
    EXPECT_EQ(record.result.reason, LostReason::kNotStarted);  // no matched features, so no metric initialisation
  }
  EXPECT_TRUE(final_poses(system).empty());
}

// Cameras 0 and 1 overlap and tell the scale; camera 2 agrees with any scale.
class SystemContradictedMap : public ::testing::Test {
 protected:
  // Shows the first `frames` frames, then one in which the images of these cameras show something else.
  FrameRecord contradict(System& system, std::size_t frames, const std::vector<std::size_t>& cameras = {0, 1}) {
    for (std::size_t k = 0; k < frames; ++k)
      EXPECT_FALSE(must_process(system, tour_.replayed(k, shown_)).map_withdrawn) << k;
    image::ImageBundle elsewhere = tour_.replayed(frames, shown_);
    for (const std::size_t c : cameras) mirror(elsewhere.images[c]);
    FrameRecord record = must_process(system, elsewhere);
    for (const std::size_t c : cameras) EXPECT_TRUE(record.result.cameras[c].excluded) << c;
    shown_ += frames + 1;
    return record;
  }

  static constexpr std::array kCameras = {0, 1, 4};
  const RenderedTour tour_{synthetic::ring_rig(8, 320).subset(kCameras), 64};
  std::size_t shown_ = 0;
};

TEST_F(SystemContradictedMap, IsDiscardedIfItIsNew) {
  System system(tour_.rig(), small_config(execution::Mode::kSequential));
  const FrameRecord withdrawn = contradict(system, 8);
  EXPECT_TRUE(withdrawn.map_withdrawn);
  EXPECT_EQ(tracked_frames(system), 0u);
  EXPECT_FALSE(withdrawn.result.anchored.reference.valid());
  EXPECT_FALSE(withdrawn.twist.has_value());
  EXPECT_FALSE(contradict(system, 60).map_withdrawn);
  EXPECT_EQ(tracked_frames(system), 61u);
}

TEST_F(SystemContradictedMap, IsKeptIfACameraThatTellsTheScaleAgrees) {
  for (const std::size_t contradicting : {0u, 1u}) {
    System system(tour_.rig(), small_config(execution::Mode::kSequential));
    const FrameRecord record = contradict(system, 8, {contradicting});
    EXPECT_FALSE(record.map_withdrawn);
    EXPECT_EQ(record.result.status, TrackStatus::kTracking);
    shown_ = 0;
  }
}

TEST_F(SystemContradictedMap, IsKeptAfterSeveralOthers) {
  System system(tour_.rig(), small_config(execution::Mode::kSequential));
  for (int before = 0; before < 4; ++before) EXPECT_EQ(contradict(system, 8).map_withdrawn, before < 3) << before;
}

// All images are at rest but for two opposite quarters, which are displaced in every third frame.
TEST(SystemSequential, DiscardsANewMapOfTwoMotions) {
  const RenderedTour& tour = rendered_tour(2, 16);
  Config config = small_config(execution::Mode::kSequential);
  config.tracking.keyframe.min_interval = 18;               // so that the map contains one of the motions only
  config.calibration.refine = calibration::Refine::kFalse;  // one keyframe is too few to compare the calibration
  System system(tour.rig(), config);
  std::size_t contested = 0, discarded = 0;
  for (std::size_t k = 0; k < 18; ++k) {
    image::ImageBundle frame = tour.replayed(0, k);
    const image::ImageBundle& moved = tour.frames()[k % 3 == 2 ? 2 : 0];
    for (std::size_t c = 0; c < 2; ++c) {
      image::Image& image = frame.images[c].image;
      for (int y = 0; y < image.height(); ++y) {
        const int half = image.width() / 2, begin = y < image.height() / 2 ? 0 : half;
        std::copy_n(moved.images[c].image.row(y) + begin, half, image.row(y) + begin);
      }
    }
    const FrameRecord record = must_process(system, frame);
    contested += record.result.contest.contested;
    if (record.map_withdrawn) {
      EXPECT_GE(contested, tracking::kContestedFrames);
      EXPECT_EQ(tracked_frames(system), 0u);
      EXPECT_EQ(system.snapshot()->num_keyframes(), 0u);
      ++discarded;
    }
  }
  EXPECT_EQ(discarded, 1u);
}

TEST(SystemSequential, DiscardsANewMapUpToScaleAndItsPosesIfLost) {
  const RenderedTour& tour = rendered_tour(1, 16);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  std::size_t k = 0;
  while (k < 8 && tracked_frames(system) == 0) must_process(system, tour.frames()[k++]);
  ASSERT_GT(tracked_frames(system), 0u);
  const KeyframeId last = system.snapshot()->newest_keyframe();
  image::ImageBundle elsewhere = tour.frames()[k++];
  mirror(elsewhere.images[0]);
  EXPECT_TRUE(must_process(system, elsewhere).map_withdrawn);
  EXPECT_EQ(tracked_frames(system), 0u);
  EXPECT_TRUE(final_poses(system).empty() && live_poses(system).empty());
  EXPECT_EQ(system.snapshot()->num_keyframes(), 0u);

  for (std::size_t i = 0; i < tour.frames().size(); ++i) {
    const FrameRecord record = must_process(system, tour.replayed(i, k));
    EXPECT_FALSE(record.map_withdrawn);
    if (record.keyframe) {
      EXPECT_GT(record.result.anchored.reference, last);
    }
  }
  system.finish();
  EXPECT_EQ(system.maps_started(), 2);
  EXPECT_GT(system.snapshot()->keyframe_ids().front(), last);
  EXPECT_GT(final_poses(system).size(), 8u);
  EXPECT_LT(ate_m(final_poses(system), tour.replayed_truth(k), evaluation::AlignMode::kSim3), 0.01);
}

// A rig that stands still adds no keyframes, so that its map stays small.
TEST(SystemSequential, KeepsASmallMapUpToScaleThatAgreedForSeconds) {
  const RenderedTour& tour = rendered_tour(1, 16);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  std::size_t k = 0;
  while (k < 8 && tracked_frames(system) == 0) must_process(system, tour.frames()[k++]);
  const std::size_t here = k - 1, rest = static_cast<std::size_t>(4 * RenderedTour::kRateHz);
  for (std::size_t end = k + rest; k < end; ++k) must_process(system, tour.replayed(here, k - here));
  const std::size_t before = tracked_frames(system);
  ASSERT_GT(before, rest);
  ASSERT_LE(system.snapshot()->num_keyframes(), 4u);
  image::ImageBundle elsewhere = tour.replayed(here, k++ - here);
  mirror(elsewhere.images[0]);
  const FrameRecord lost = must_process(system, elsewhere);
  EXPECT_EQ(lost.result.status, TrackStatus::kLost);
  EXPECT_FALSE(lost.map_withdrawn);
  EXPECT_EQ(must_process(system, tour.replayed(here, k++ - here)).result.status, TrackStatus::kTracking);
  EXPECT_EQ(tracked_frames(system), before + 1);
  EXPECT_EQ(system.maps_started(), 1);
}

TEST(SystemSequential, KeepsANewMapDuringADarkFrame) {
  const RenderedTour& tour = rendered_tour(1, 16);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  std::size_t k = 0;
  while (k < 8 && tracked_frames(system) == 0) must_process(system, tour.frames()[k++]);
  const std::size_t before = tracked_frames(system);
  ASSERT_GT(before, 0u);
  image::ImageBundle dark = tour.frames()[k++];
  blacken(dark.images[0]);
  EXPECT_EQ(must_process(system, dark).result.reason, LostReason::kNoImages);
  EXPECT_EQ(tracked_frames(system), before);
  while (k < tour.frames().size()) must_process(system, tour.frames()[k++]);
  EXPECT_EQ(system.maps_started(), 1);
  EXPECT_GT(tracked_frames(system), before + 4);
}

TEST(SystemSequential, InitialisesUpToScaleSoonAfterADarkFirstFrame) {
  const RenderedTour& tour = rendered_tour(1, 16);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  image::ImageBundle dark = tour.frames()[0];
  blacken(dark.images[0]);
  must_process(system, dark);
  for (std::size_t i = 0; i < tour.frames().size(); ++i) must_process(system, tour.replayed(i, 1));
  EXPECT_GT(tracked_frames(system), 8u);
}

// The first one is made from an earlier frame than the one that initialises the map.
TEST(SystemSequential, KeyframesOfAMonocularInitialisationHaveTheTimesOfTheirFrames) {
  const RenderedTour& tour = rendered_tour(1, 8);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (std::size_t k = 0; k < 8 && tracked_frames(system) == 0; ++k) must_process(system, tour.frames()[k]);
  const map::MapSnapshot map = system.snapshot();
  ASSERT_EQ(map->num_keyframes(), 2u);
  for (const KeyframeId k : map->keyframe_ids())
    EXPECT_EQ(system.keyframe_time(k), map->keyframe(k).frame->time_ns) << k.value();
  EXPECT_LT(system.keyframe_time(KeyframeId(0)), system.keyframe_time(KeyframeId(1)));
}

TEST(SystemSequential, RejectsAnInvalidFrameAndContinues) {
  const RenderedTour& tour = rendered_tour(2, 6);
  System system(tour.rig(), small_config(execution::Mode::kSequential)),
      undisturbed(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : tour.frames()) {
    image::ImageBundle wrong = images;
    wrong.images.pop_back();
    EXPECT_FALSE(system.process(wrong).ok());
    must_process(system, images);
    must_process(undisturbed, images);
    EXPECT_FALSE(system.process(images).ok());  // not after the last frame
  }
  EXPECT_EQ(system.frames().size(), tour.frames().size());
  EXPECT_TRUE(identical(live_poses(system), live_poses(undisturbed)));
}

TEST(SystemSequential, KeepsTheConfiguredHistory) {
  constexpr std::size_t kHistory = 4;
  const RenderedTour& tour = rendered_tour(2, 16);
  System all(tour.rig(), small_config(execution::Mode::kSequential)),
      bounded(tour.rig(), small_config(execution::Mode::kSequential), {.history = kHistory});
  for (const image::ImageBundle& images : tour.frames()) {
    must_process(all, images);
    const FrameRecord record = must_process(bounded, images);
    EXPECT_LT(bounded.frames().size(), 2 * kHistory);
    EXPECT_GE(bounded.frames().size(), std::min(kHistory, images.id.index() + 1));
    EXPECT_EQ(bounded.frames().back().result.frame, record.result.frame);
  }
  all.finish();
  bounded.finish();
  EXPECT_TRUE(bounded.journal().entries.empty());
  const evaluation::Trajectory whole = final_poses(all), last = final_poses(bounded);
  ASSERT_GE(last.size(), kHistory);
  EXPECT_TRUE(identical({whole.end() - static_cast<std::ptrdiff_t>(last.size()), whole.end()}, last));
}

TEST(SystemSequential, FinalAdjustmentDecreasesTheCost) {
  const RenderedTour& tour = rendered_tour(2, 8);
  Config config = small_config(execution::Mode::kSequential);
  config.mapping.global.final_iterations = 0;  // the round on the inliers minimises another cost
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  const map::MapSnapshot before = system.snapshot();
  system.finish();
  const auto cost = [&](const map::BundledMap& map) {
    return adjustment::robust_cost(*before, mapping::select_all(*before), config.feature_model(), map);
  };
  EXPECT_LT(cost(*system.snapshot()), cost(*before));
}

TEST(SystemSequential, AdjustsTheWholeMapAtTheEndOnlyIfConfigured) {
  const RenderedTour& tour = rendered_tour(2, 8);
  for (const bool wanted : {false, true}) {
    Config config = small_config(execution::Mode::kSequential);
    config.final_adjustment = wanted;
    System system(tour.rig(), config);
    for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
    const MapVersion before = system.snapshot()->version();
    system.finish();
    EXPECT_EQ(system.snapshot()->version() > before, wanted);
    EXPECT_EQ(system.final_adjustment_ms() > 0, wanted);
  }
}

}  // namespace
}  // namespace bslam::system
