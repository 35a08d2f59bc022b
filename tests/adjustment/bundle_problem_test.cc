#include "adjustment/bundle_problem.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::adjustment {
namespace {

constexpr double kDetected = 0.4;

// Keyframes of one camera; `sigma` is the standard deviation of all keypoints of each keyframe.
map::BundledMap keyframes_with(const std::vector<float>& sigma) {
  map::BundledMap out(map::synthetic_rig(1));
  Random random(1);
  for (const float s : sigma) {
    auto frame = std::make_shared<frame::BundledFrame>(*map::synthetic_frame(random, 1, 5, 0));
    feature::Keypoints& keypoints = frame->cameras[0].keypoints;
    keypoints.sigma = std::vector<float>(keypoints.size(), s);
    keypoints.level = std::vector<std::uint8_t>(keypoints.size(), 0);
    out.add_keyframe(frame, geometry::SE3(), {}, out.newest_keyframe());
  }
  return out;
}

std::vector<float> sigmas_of_one_landmark(map::BundledMap& map, const std::vector<map::Observation>& observations,
                                          std::size_t reference) {
  const map::Observation& r = observations[reference];
  const frame::KeypointRef keypoint = map.keyframe(r.keyframe).frame->bundled.keypoints(r.feature).front();
  const LandmarkId l = map.add_landmark({0, 0, 5}, observations, {r.keyframe, keypoint});
  const BundleProblem selected = build_problem(
      map, {.free_keyframes = map.keyframe_ids(), .fixed_keyframes = {}, .landmarks = {l}}, {kDetected, {}});
  std::vector<float> out;
  for (const auto& o : selected.problem.observations) out.push_back(o.sigma);
  return out;
}

TEST(BuildProblem, ReferenceGetsTheAccuracyOfAlignedKeypoints) {
  map::BundledMap map = keyframes_with({0.5f, 0.15f, 0.2f});
  const std::vector<map::Observation> seen = {
      {KeyframeId(0), FeatureId(2)}, {KeyframeId(1), FeatureId(2)}, {KeyframeId(2), FeatureId(2)}};
  EXPECT_EQ(sigmas_of_one_landmark(map, seen, 0), (std::vector<float>{0.15f, 0.15f, 0.2f}));
}

TEST(BuildProblem, ReferenceIsUnchangedIfNothingIsAlignedToIt) {
  map::BundledMap map = keyframes_with({0.35f, 0.15f});
  const std::vector<map::Observation> seen = {{KeyframeId(0), FeatureId(1)}, {KeyframeId(1), FeatureId(1), false}};
  EXPECT_EQ(sigmas_of_one_landmark(map, seen, 0), (std::vector<float>{0.35f, static_cast<float>(kDetected)}));
}

TEST(BuildProblem, ReferenceIsUnchangedIfItIsMoreAccurate) {
  map::BundledMap map = keyframes_with({0.1f, 0.15f});
  const std::vector<map::Observation> seen = {{KeyframeId(0), FeatureId(1)}, {KeyframeId(1), FeatureId(1)}};
  EXPECT_EQ(sigmas_of_one_landmark(map, seen, 0), (std::vector<float>{0.1f, 0.15f}));
}

}  // namespace
}  // namespace bslam::adjustment
