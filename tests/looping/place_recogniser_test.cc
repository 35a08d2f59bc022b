#include "looping/place_recogniser.h"

#include <gtest/gtest.h>

#include "simulated_hall.h"

namespace bslam::looping {
namespace {

// Accepts every keyframe that shares a word.
const RecognitionOptions kLoose{.min_common_word_ratio = 0, .min_group_score_ratio = 0, .max_candidates = 100};

void expect_equal(const std::vector<PlaceCandidate>& a, const std::vector<PlaceCandidate>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].keyframe, b[i].keyframe);
    EXPECT_EQ(a[i].score, b[i].score);
  }
}

class RecogniserRig : public ::testing::TestWithParam<int> {};

TEST_P(RecogniserRig, RanksTheRevisitedPlaceFirst) {
  const HallMap& world = map_with_drift(GetParam());
  for (const int again : {kLapKeyframes, kLapKeyframes + 1}) {
    const std::vector<PlaceCandidate> candidates = recogniser()->query_keyframe(world.map, KeyframeId(again));
    ASSERT_FALSE(candidates.empty());
    EXPECT_LE(std::abs(candidates.front().keyframe.value() - (again - kLapKeyframes)), 2);
    for (std::size_t i = 1; i < candidates.size(); ++i) EXPECT_LE(candidates[i].score, candidates[i - 1].score);
  }
}

TEST_P(RecogniserRig, KeepsNoFrameAlive) {
  const HallMap& world = map_with_drift(GetParam());
  const auto recognises = recogniser();
  const auto& frame = world.map.keyframe(KeyframeId(0)).frame;
  const auto owners = frame.use_count();
  EXPECT_FALSE(recognises->query_keyframe(world.map, KeyframeId(kLapKeyframes)).empty());
  EXPECT_EQ(frame.use_count(), owners);
}

TEST_P(RecogniserRig, RanksTheTrueNeighbourhoodOfAFrameFirst) {
  const HallMap& world = map_without_drift(GetParam());
  const FeatureSimulator simulator = hall(rig_of(GetParam()));
  for (const int at : {2, 9, 17, 28}) {
    const auto frame = described(simulator.frame(FrameId(1000 + at), kStepS * at + 0.5));
    const std::vector<PlaceCandidate> candidates = recogniser()->query_frame(world.map, frame);
    ASSERT_FALSE(candidates.empty());
    EXPECT_LE(std::abs(candidates.front().keyframe.value() - at), 2);
  }
}

TEST_P(RecogniserRig, NeighboursAreNeverCandidates) {
  const HallMap& world = map_with_drift(GetParam());
  const auto loose = recogniser(kLoose);
  std::size_t candidates = 0;
  for (const KeyframeId k : world.map.keyframe_ids()) {
    const auto& table = world.map.keyframe(k).landmarks.values();
    const auto landmarks = std::ranges::count_if(table, [](LandmarkId l) { return l.valid(); });
    for (const PlaceCandidate& c : loose->query_keyframe(world.map, k)) {
      ++candidates;
      EXPECT_NE(c.keyframe, k);
      for (const map::Covisible& n : world.map.keyframe(k).covisible) {
        if (n.keyframe == c.keyframe) {
          EXPECT_LT(n.weight, std::max(15.0, 0.05 * static_cast<double>(landmarks)));
        }
      }
    }
  }
  EXPECT_GT(candidates, 5u);
}

INSTANTIATE_TEST_SUITE_P(Cameras, RecogniserRig, ::testing::Values(1, 2, 4));

// The place has changed so much that it is less similar to the keyframe than the neighbours of the keyframe.
TEST(BagOfWordsRecogniser, DiscardsPlacesLessSimilarThanTheNeighbours) {
  const FeatureSimulator simulator = hall(rig_of(1));
  HallMap world(simulator.rig());
  for (int i = 0; i < 3; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
  for (int i = 3; i < 6; ++i) world.add(simulator.frame(FrameId(i), 20 + kStepS * i), {}, 1);
  for (int i = 6; i < 9; ++i) world.add(redecorated(simulator.frame(FrameId(i), kLapS + 0.3 * (i - 6)), 0.8, 1), {}, 2);
  const KeyframeId newest(8);
  ASSERT_GE(world.map.best_covisible(newest, 1).front().weight, RecognitionOptions().min_neighbour_landmarks);
  EXPECT_TRUE(recogniser()->query_keyframe(world.map, newest).empty());
  // Without neighbours there is no such bound: the place becomes a candidate, ranked after the former neighbours.
  const RecognitionOptions unbound{
      .min_common_word_ratio = 0, .min_group_score_ratio = 0, .min_neighbour_landmarks = 10000};
  const std::vector<PlaceCandidate> without = recogniser(unbound)->query_keyframe(world.map, newest);
  EXPECT_TRUE(std::ranges::any_of(without, [](const PlaceCandidate& c) { return c.keyframe.value() < 3; }));
}

// For example two rooms, one of which is partly visible from the other through a door.
TEST(BagOfWordsRecogniser, OneCommonLandmarkDoesNotJoinTwoPlaces) {
  const FeatureSimulator simulator = hall(rig_of(1));
  HallMap world(simulator.rig());
  world.add(simulator.frame(FrameId(0), 0.0));
  world.add(simulator.frame(FrameId(1), 0.2), {}, 1);  // a room that looks the same
  const auto frame = described(simulator.frame(FrameId(7), 0.1));
  ASSERT_EQ(recogniser(kLoose)->query_frame(world.map, frame).size(), 2u);
  const auto any_of = [&](KeyframeId k) {
    return *std::ranges::find_if(world.map.keyframe(k).landmarks.values(), [](LandmarkId l) { return l.valid(); });
  };
  ASSERT_TRUE(world.map.merge_landmarks(any_of(KeyframeId(1)), any_of(KeyframeId(0))));
  ASSERT_EQ(world.map.best_covisible(KeyframeId(0), 1).front().weight, 1);
  EXPECT_EQ(recogniser(kLoose)->query_frame(world.map, frame).size(), 2u);
}

TEST(BagOfWordsRecogniser, ResultsDoNotDependOnEarlierQueries) {
  const HallMap& world = map_with_drift(1);
  const HallMap& other = map_without_drift(1);
  const KeyframeId last(kLapKeyframes + 1);
  map::MapDraft thinned = world.draft();
  for (const int k : {3, 7, 30}) thinned.remove_keyframe(KeyframeId(k));
  const auto frame = described(hall(rig_of(1)).frame(FrameId(1000), 9.5));

  const auto reused = recogniser();
  for (int turn = 0; turn < 2; ++turn) {
    expect_equal(reused->query_keyframe(world.map, last), recogniser()->query_keyframe(world.map, last));
    expect_equal(reused->query_frame(other.map, frame), recogniser()->query_frame(other.map, frame));
    expect_equal(reused->query_keyframe(thinned.map(), last), recogniser()->query_keyframe(thinned.map(), last));
    expect_equal(reused->query_frame(world.map, frame), recogniser()->query_frame(world.map, frame));
  }
}

TEST(BagOfWordsRecogniser, DoesNotReturnRemovedKeyframes) {
  const HallMap& world = map_with_drift(1);
  const KeyframeId last(kLapKeyframes + 1);
  const auto places = recogniser(kLoose);
  const auto found = [&](const std::vector<PlaceCandidate>& candidates, KeyframeId k) {
    return std::ranges::find(candidates, k, &PlaceCandidate::keyframe) != candidates.end();
  };
  const KeyframeId best = places->query_keyframe(world.map, last).front().keyframe;
  map::MapDraft draft = world.draft();
  if (!draft.remove_keyframe(best)) GTEST_FAIL() << "the best one is the root";
  const std::vector<PlaceCandidate> after = places->query_keyframe(draft.map(), last);
  EXPECT_FALSE(after.empty());
  EXPECT_FALSE(found(after, best));
}

TEST(BagOfWordsRecogniser, HandlesANewMapWithTheSameIds) {
  const FeatureSimulator simulator = hall(rig_of(1));
  HallMap fresh(simulator.rig());  // the same ids belong to another region of the hall
  for (int i = 0; i < 8; ++i) fresh.add(simulator.frame(FrameId(i), 24 + kStepS * i));
  const auto places = recogniser();
  const auto frame = described(simulator.frame(FrameId(1000), 26.4));
  places->query_frame(map_without_drift(1).map, frame);
  const std::vector<PlaceCandidate> candidates = places->query_frame(fresh.map, frame);
  ASSERT_FALSE(candidates.empty());
  EXPECT_LE(std::abs(candidates.front().keyframe.value() - 2), 1);
  expect_equal(candidates, recogniser()->query_frame(fresh.map, frame));
}

TEST(BagOfWordsRecogniser, ReturnsNothingForAFrameWithoutImages) {
  const std::vector<int> all = {0, 1};
  const auto frame = described(hall(rig_of(2)).frame(FrameId(1000), 3.0, all));
  EXPECT_TRUE(recogniser()->query_frame(map_without_drift(2).map, frame).empty());
}

}  // namespace
}  // namespace bslam::looping
