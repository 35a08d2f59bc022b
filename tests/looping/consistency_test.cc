#include "looping/consistency.h"

#include <gtest/gtest.h>

#include "simulated_hall.h"

namespace bslam::looping {
namespace {

// A path whose keyframes are covisible with the adjacent ones; keyframes 3 to 6 are one place, 20 to 23 another.
class Consistency : public ::testing::Test {
 protected:
  Consistency() {
    options.consistent_keyframes = 3;
    options.max_keyframe_gap = 3;
  }
  // Returns the consistent candidates of a keyframe.
  std::vector<KeyframeId> consistent(int keyframe, const std::vector<int>& candidates) {
    std::vector<PlaceCandidate> list;
    for (const int c : candidates) list.push_back({KeyframeId(c), 1.0});
    std::vector<KeyframeId> out;
    for (const PlaceCandidate& c : consistent_candidates(map_, KeyframeId(keyframe), list, options, history_))
      out.push_back(c.keyframe);
    return out;
  }
  static std::vector<KeyframeId> ids(const std::vector<int>& values) { return {values.begin(), values.end()}; }

  LoopOptions options;
  const map::BundledMap& map_ = map_without_drift(1).map;
  RecognitionHistory history_;
};

TEST_F(Consistency, RequiresConsecutiveRecognitions) {
  EXPECT_EQ(consistent(28, {3}), ids({}));
  EXPECT_EQ(consistent(29, {4}), ids({}));
  EXPECT_EQ(consistent(30, {5}), ids({5}));
  EXPECT_EQ(consistent(31, {6}), ids({6}));
}

TEST_F(Consistency, AcceptsTheFirstKeyframeIfOnlyOneIsRequired) {
  options.consistent_keyframes = 1;
  EXPECT_EQ(consistent(28, {3, 20}), ids({3, 20}));
}

TEST_F(Consistency, CountsSeveralCandidatesOfOneKeyframeOnce) {
  EXPECT_EQ(consistent(28, {3, 4, 5}), ids({}));
  EXPECT_EQ(consistent(29, {3, 4, 5}), ids({}));
  EXPECT_EQ(consistent(30, {3, 4, 5}), ids({3, 4, 5}));
}

TEST_F(Consistency, CountsEachPlaceSeparately) {
  EXPECT_EQ(consistent(28, {3}), ids({}));
  EXPECT_EQ(consistent(29, {20}), ids({}));
  EXPECT_EQ(consistent(30, {21, 4}), ids({}));
  EXPECT_EQ(consistent(31, {5, 22}), ids({5, 22}));
}

TEST_F(Consistency, ToleratesShortGaps) {
  consistent(20, {3});
  consistent(22, {});
  EXPECT_EQ(consistent(23, {4}), ids({}));  // the second recognition
  EXPECT_EQ(consistent(26, {5}), ids({5}));
}

TEST_F(Consistency, DropsAPlaceAfterALongGap) {
  consistent(20, {3});
  consistent(21, {4});
  EXPECT_EQ(consistent(25, {5}), ids({}));
  EXPECT_EQ(consistent(26, {5}), ids({}));
  EXPECT_EQ(consistent(27, {5}), ids({5}));
}

TEST_F(Consistency, DropsTheHistoryOfPlacesNotRecognisedAgain) {
  consistent(20, {3, 20});
  EXPECT_EQ(history_.places.size(), 2u);
  consistent(21, {});
  EXPECT_EQ(history_.places.size(), 2u);
  consistent(24, {});
  EXPECT_TRUE(history_.places.empty());
}

}  // namespace
}  // namespace bslam::looping
