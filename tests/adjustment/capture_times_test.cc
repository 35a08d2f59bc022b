#include "adjustment/capture_times.h"

#include <gtest/gtest.h>

#include <cmath>

#include "adjustment/map_adjustment.h"
#include "mapping/simulated_map.h"

namespace bslam::adjustment {
namespace {

constexpr feature::FeatureModel kStampFeatures{.sigma_px = 0.7, .pyramid = {}};
constexpr double kStampDeviation_s = 0.004;
constexpr int kMapKeyframes = 12;

// A map of true poses whose keyframes have stamps with errors in all cameras but the first.
struct MapWithWrongStamps {
  map::SimulatedMap world;
  std::vector<std::vector<double>> error_s;  // by keyframe and camera
};

MapWithWrongStamps make_map(double variance_s2) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 500;
  options.sigma_px = kStampFeatures.sigma_px;
  MapWithWrongStamps out{
      map::SimulatedMap(synthetic::FeatureSimulator(synthetic::ring_rig(3), synthetic::make_orbit({}), options)), {}};
  out.world.knows_motion = true;
  Random random(7, "stamps");
  out.world.change_frame = [&](frame::BundledFrame& frame) {
    std::vector<double>& errors = out.error_s.emplace_back(frame.cameras.size(), 0.0);
    for (std::size_t c = 1; c < frame.cameras.size(); ++c) {
      errors[c] = kStampDeviation_s * random.normal();
      frame.cameras[c].time_ns += from_seconds(errors[c]);
      frame.cameras[c].stamp_variance_s2 = variance_s2;
    }
  };
  for (int i = 0; i < kMapKeyframes; ++i) out.world.add_keyframe(FrameId(i), 0.25 * i);
  out.world.change_frame = nullptr;
  return out;
}

// Root mean square of the errors of the capture times.
double time_error_s(const map::BundledMap& map, const MapWithWrongStamps& made) {
  double sum = 0;
  int count = 0;
  for (const KeyframeId k : map.keyframe_ids()) {
    for (std::size_t c = 1; c < 3; ++c, ++count) {
      const frame::BundledFrame& frame = *map.keyframe(k).frame;
      const double error = made.error_s[k.index()][c] + to_seconds(frame.cameras[c].correction_ns);
      EXPECT_NEAR(frame.delay_s(c), error, 1e-8);
      sum += error * error;
    }
  }
  return std::sqrt(sum / count);
}

Selection everything(const map::BundledMap& map) {
  Selection out;
  for (const KeyframeId k : map.keyframe_ids())
    (k.value() == 0 ? out.fixed_keyframes : out.free_keyframes).push_back(k);
  out.landmarks = map.landmark_ids();
  return out;
}

// What remains is mostly the mean error of each camera, that is a time offset, which few images overlap to show.
TEST(CorrectCaptureTimes, AdjustmentFindsTheErrorsOfStamps) {
  const MapWithWrongStamps made = make_map(kStampDeviation_s * kStampDeviation_s);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(made.world.map));
  const double before = time_error_s(draft.map(), made);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(adjust_map(everything(draft.map()), {}, kStampFeatures, draft));
  const double after = time_error_s(draft.map(), made);
  std::printf("errors of the capture times: %.2f ms, after adjustment %.2f ms\n", 1e3 * before, 1e3 * after);
  EXPECT_LT(after, 0.35 * before);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(CorrectCaptureTimes, ExactStampsStayAsTheyAre) {
  const MapWithWrongStamps made = make_map(0);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(made.world.map));
  ASSERT_TRUE(adjust_map(everything(draft.map()), {}, kStampFeatures, draft));
  for (const KeyframeId k : draft.map().keyframe_ids()) {
    for (const frame::CameraFrame& camera : draft.map().keyframe(k).frame->cameras) EXPECT_EQ(camera.correction_ns, 0);
  }
}

// The first keyframes were created before the errors were known.
TEST(CorrectCaptureTimes, TheVarianceOfOneKeyframeHoldsForAll) {
  MapWithWrongStamps made = make_map(0);
  made.world.change_frame = [](frame::BundledFrame& frame) {
    for (frame::CameraFrame& camera : frame.cameras) camera.stamp_variance_s2 = kStampDeviation_s * kStampDeviation_s;
  };
  made.world.add_keyframe(FrameId(kMapKeyframes), 0.25 * kMapKeyframes);
  made.error_s.emplace_back(3, 0.0);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(made.world.map));
  const double before = time_error_s(draft.map(), made);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(adjust_map(everything(draft.map()), {}, kStampFeatures, draft));
  EXPECT_LT(time_error_s(draft.map(), made), 0.35 * before);
}

// Such as those of a fixed keyframe, of whose landmarks other cameras see a few: tracking, which saw all, knows more.
TEST(CorrectCaptureTimes, ImagesWithFewObservationsInTheProblemKeepTheirCorrections) {
  constexpr TimeNs kCorrection = 3'000'000;
  const MapWithWrongStamps made = make_map(kStampDeviation_s * kStampDeviation_s);
  map::MapDraft draft(std::make_shared<const map::BundledMap>(made.world.map));
  for (const KeyframeId k : draft.map().keyframe_ids()) draft.correct_times({{k, CameraIndex(1), kCorrection}});
  Selection few = everything(draft.map());
  few.landmarks.resize(few.landmarks.size() / 4);
  ASSERT_TRUE(adjust_map(few, {}, kStampFeatures, draft));
  std::size_t kept = 0;
  for (const KeyframeId k : draft.map().keyframe_ids())
    kept += draft.map().keyframe(k).frame->cameras[1].correction_ns == kCorrection;
  EXPECT_GT(kept, draft.map().keyframe_ids().size() / 2);
}

}  // namespace
}  // namespace bslam::adjustment
