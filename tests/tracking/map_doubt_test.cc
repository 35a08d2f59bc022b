#include "tracking/map_doubt.h"

#include <gtest/gtest.h>

#include "tracking/camera_consensus.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

bool contradicts(int matched, int inliers) {
  return contradicts_pose({.keypoints = 1000, .matched = matched, .inliers = inliers});
}

// Of images that are those of their cameras, more than 60 % of the matches are inliers.
TEST(ContradictsPose, ManyMatchesThatAreNoInliersContradictThePose) {
  EXPECT_FALSE(contradicts(500, 310));
  EXPECT_FALSE(contradicts(500, 230));
  EXPECT_TRUE(contradicts(500, 210));
  EXPECT_FALSE(contradicts(30, 8));
  EXPECT_TRUE(contradicts(30, 7));
  EXPECT_FALSE(contradicts(29, 0));
}

// Two cameras in front that overlap, and one behind without overlap.
const camera::Rig& rig() {
  static const camera::Rig rig = synthetic::ring_rig(3);
  return rig;
}

// A run whose map consists of a number of keyframes.
class DoubtfulRun {
 public:
  // `without`: a camera that has no images in the keyframes.
  explicit DoubtfulRun(map::Scale scale, std::size_t keyframes = 2, std::optional<std::size_t> without = {})
      : scale_(scale), world_(simulator(rig())) {
    world_.change_frame = [without](frame::BundledFrame& frame) {
      const InitialisationOptions options;
      if (without) remove_camera(rig(), *without, options.min_parallax, options.max_chi2, frame);
    };
    add_keyframes(keyframes);
  }

  void add_keyframes(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto number = static_cast<int>(world_.map.keyframe_slots());
      world_.add_keyframe(FrameId(1000 + number), 0.1 * number);
    }
    world_.map.set_scale(scale_);
  }

  // The first frame with a pose initialises the map, so that it was tracked in one without keyframes.
  bool start(double time_s) {
    map::BundledMap before(world_.map.shared_rig());
    before.set_scale(scale_);
    return doubt_.update(tracked(time_s), before, true);
  }
  bool update(const FrameRecord& record, bool calibration_compared = true) {
    return doubt_.update(record, world_.map, calibration_compared);
  }

  static FrameRecord tracked(double time_s) {
    FrameRecord record;
    record.result.time_ns = static_cast<TimeNs>(1e9 * time_s);
    record.result.status = TrackStatus::kTracking;
    record.result.reason = LostReason::kNone;
    record.result.cameras.assign(rig().size(), {.keypoints = 1000, .matched = 500, .inliers = 400});
    return record;
  }
  static FrameRecord undecided(double time_s) {
    FrameRecord record = tracked(time_s);
    record.result.contest = {.contested = true, .undecided = true};
    return record;
  }
  static FrameRecord lost(double time_s, LostReason reason = LostReason::kFewMatches) {
    FrameRecord record = tracked(time_s);
    record.result.status = TrackStatus::kLost;
    record.result.reason = reason;
    return record;
  }
  static FrameRecord excluding(double time_s, const std::vector<std::size_t>& cameras) {
    FrameRecord record = tracked(time_s);
    for (const std::size_t c : cameras) record.result.cameras[c].excluded = true;
    return record;
  }

 private:
  map::Scale scale_;
  map::SimulatedMap world_;
  MapDoubt doubt_{rig()};
};

TEST(MapDoubt, ANewMapOfArbitraryScaleInWhichTrackingIsLostIsWrong) {
  for (const LostReason reason : {LostReason::kFewMatches, LostReason::kFewInliers, LostReason::kUnstablePose}) {
    DoubtfulRun run(map::Scale::kUpToScale);
    EXPECT_FALSE(run.start(1.0));
    EXPECT_FALSE(run.update(DoubtfulRun::tracked(1.1)));
    EXPECT_TRUE(run.update(DoubtfulRun::lost(1.2, reason)));
  }
  for (const LostReason reason : {LostReason::kNoImages, LostReason::kFewFeatures}) {
    DoubtfulRun run(map::Scale::kUpToScale);
    run.start(1.0);
    EXPECT_FALSE(run.update(DoubtfulRun::lost(1.1, reason)));
  }
}

TEST(MapDoubt, AMapThatIsMetricOrOldOrLargeIsRightIfTrackingIsLost) {
  DoubtfulRun metric(map::Scale::kMetric), old(map::Scale::kUpToScale), large(map::Scale::kUpToScale, 5);
  metric.start(1.0);
  EXPECT_FALSE(metric.update(DoubtfulRun::lost(1.1)));
  old.start(1.0);
  EXPECT_FALSE(old.update(DoubtfulRun::lost(4.1)));
  large.start(1.0);
  EXPECT_FALSE(large.update(DoubtfulRun::lost(1.1)));
}

// If each camera loses some of its images, a frame may have none of those that observe the map.
TEST(MapDoubt, ANewMapIsNotWrongIfNoCameraThatObservesItHasAnImage) {
  DoubtfulRun run(map::Scale::kUpToScale, 2, /*without=*/2);
  run.start(1.0);
  FrameRecord record = DoubtfulRun::lost(1.1);
  for (const std::size_t c : {0, 1}) record.result.cameras[c].keypoints = 0;
  EXPECT_FALSE(run.update(record)) << "only camera 2 has an image";
  record.result.cameras[1].keypoints = 1000;
  EXPECT_TRUE(run.update(record));
}

// Keyframes of maps that were discarded before do not count.
TEST(MapDoubt, IsForgottenWithTheMap) {
  DoubtfulRun run(map::Scale::kUpToScale, 4);
  run.start(1.0);
  EXPECT_TRUE(run.update(DoubtfulRun::lost(1.1)));
  EXPECT_FALSE(run.update(DoubtfulRun::lost(1.2))) << "there is no map";
  EXPECT_FALSE(run.update(DoubtfulRun::tracked(1.3)));
  run.add_keyframes(4);
  EXPECT_TRUE(run.update(DoubtfulRun::lost(1.4)));
}

TEST(MapDoubt, CamerasWithoutOverlapDoNotOutvoteThoseThatDetermineTheScale) {
  const auto wrong = [](const std::vector<std::size_t>& excluded, map::Scale scale = map::Scale::kMetric) {
    DoubtfulRun run(scale);
    run.start(1.0);
    return run.update(DoubtfulRun::excluding(1.1, excluded));
  };
  EXPECT_TRUE(wrong({0, 1}));
  EXPECT_FALSE(wrong({0, 2}));
  EXPECT_FALSE(wrong({2}));
  EXPECT_FALSE(wrong({0, 1}, map::Scale::kUpToScale));
}

TEST(MapDoubt, ManyUndecidedPosesWithinAShortTimeMakeANewMapWrong) {
  for (const double interval_s : {0.1, 0.3}) {
    DoubtfulRun run(map::Scale::kMetric);
    run.start(1.0);
    int frames = 1;
    while (frames < 8 && !run.update(DoubtfulRun::undecided(1.0 + interval_s * frames))) ++frames;
    EXPECT_EQ(frames, interval_s < 0.2 ? static_cast<int>(kContestedFrames) : 8);
  }
}

// A wrong calibration looks like things that move, and is estimated from the map.
TEST(MapDoubt, UndecidedPosesDoNotCountBeforeTheCalibrationWasCompared) {
  DoubtfulRun run(map::Scale::kMetric);
  run.start(1.0);
  for (int i = 1; i < 8; ++i) EXPECT_FALSE(run.update(DoubtfulRun::undecided(1.0 + 0.05 * i), false));
  for (int i = 8; i < 12; ++i) EXPECT_FALSE(run.update(DoubtfulRun::undecided(1.0 + 0.05 * i)));
  EXPECT_TRUE(run.update(DoubtfulRun::undecided(1.6)));
}

TEST(MapDoubt, AfterSeveralContradictedMapsTheCamerasAreWrong) {
  DoubtfulRun run(map::Scale::kMetric, 0);
  for (int map = 0; map < 4; ++map) {
    EXPECT_FALSE(run.update(DoubtfulRun::tracked(map)));
    EXPECT_EQ(run.update(DoubtfulRun::excluding(map + 0.1, {0, 1})), map < 3) << map;
  }
}

}  // namespace
}  // namespace bslam::tracking
