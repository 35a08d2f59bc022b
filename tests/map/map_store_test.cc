#include "map/map_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "synthetic_map.h"

namespace bslam::map {
namespace {

TEST(MapStore, DoesNotReuseIdsAfterARestart) {
  Random random(1);
  MapStore store{BundledMap(synthetic_rig(1))};
  const auto add = [&] {
    MapDraft draft(store.snapshot());
    const KeyframeId k = draft.add_keyframe(synthetic_frame(random, 1, 10, 0), {}, {}, {});
    draft.add_landmark({0, 0, 5}, {{k, FeatureId(3)}});
    draft.set_scale(Scale::kUpToScale);
    return store.commit(std::move(draft));
  };
  add();
  const CommitReport before = add();
  store.restart();
  const MapSnapshot emptied = store.snapshot();
  EXPECT_EQ(emptied->version(), before.published->version().next());
  EXPECT_EQ(emptied->num_keyframes() + emptied->num_landmarks() + emptied->num_observations(), 0u);
  EXPECT_EQ(emptied->scale(), Scale::kMetric);
  EXPECT_EQ(emptied->check_invariants().value_or("valid"), "valid");
  const CommitReport after = add();
  EXPECT_EQ(after.keyframes, std::vector{before.keyframes[0].next()});
  EXPECT_EQ(after.landmarks, std::vector{before.landmarks[0].next()});
  EXPECT_EQ(after.published->roots(), after.keyframes);
}

// A calibration that was estimated from a wrong map is wrong as well.
TEST(MapStore, ARestartWithdrawsTheEstimatedCalibration) {
  const camera::Rig given = *synthetic_rig(2);
  MapStore store{BundledMap(synthetic_rig(2))};
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < given.size(); ++c) cameras.push_back({given.camera(c), given.body_from_cam(c)});
  cameras[1].T_body_cam = cameras[1].T_body_cam * geometry::SE3(Eigen::Quaterniond::Identity(), {0.01, 0, 0});
  MapDraft draft(store.snapshot());
  draft.set_rig(camera::Rig(std::move(cameras)), std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Zero(6, 6)));
  ASSERT_FALSE(store.commit(std::move(draft)).published->rig().same_calibration(given));
  store.restart();
  EXPECT_TRUE(store.snapshot()->rig().same_calibration(given));
  EXPECT_EQ(store.snapshot()->rig_deviation(), nullptr);
}

TEST(MapStore, CountsVersionsAndKeepsProvisionalIdsWithoutOtherCommits) {
  Random random(1);
  MapStore store{BundledMap(synthetic_rig(1))};
  EXPECT_EQ(store.snapshot()->version(), MapVersion(0));
  MapDraft draft(store.snapshot());
  const KeyframeId k = draft.add_keyframe(synthetic_frame(random, 1, 10, 0), {}, {}, {});
  const LandmarkId l = draft.add_landmark({0, 0, 5}, {{k, FeatureId(3)}});
  EXPECT_EQ(store.snapshot()->keyframe_slots(), 0u);  // the draft is not visible to other threads
  const CommitReport report = store.commit(std::move(draft));
  EXPECT_FALSE(report.rebased);
  EXPECT_EQ(report.applied, 2u);
  EXPECT_EQ(report.keyframes, std::vector{k});
  EXPECT_EQ(report.landmarks, std::vector{l});
  EXPECT_EQ(report.published, store.snapshot());
  EXPECT_EQ(report.published->version(), MapVersion(1));
  EXPECT_EQ(report.published->landmark_of(k, FeatureId(3)), l);
}

TEST(MapStore, AssignsTheNextIdsAfterOtherCommits) {
  Random random(1);
  MapStore store{BundledMap(synthetic_rig(1))};
  MapDraft first(store.snapshot()), second(store.snapshot());
  for (MapDraft* draft : {&first, &second}) {
    const KeyframeId k = draft->add_keyframe(synthetic_frame(random, 1, 10, 0), {}, {}, {});
    EXPECT_EQ(k, KeyframeId(0));
    draft->add_landmark({0, 0, 5}, {{k, FeatureId(3)}});
  }
  store.commit(std::move(first));
  const CommitReport report = store.commit(std::move(second));
  EXPECT_TRUE(report.rebased);
  EXPECT_EQ(report.keyframes, std::vector{KeyframeId(1)});
  EXPECT_EQ(report.landmarks, std::vector{LandmarkId(1)});
  EXPECT_EQ(report.published->version(), MapVersion(2));
  EXPECT_EQ(report.published->landmark_of(KeyframeId(1), FeatureId(3)), LandmarkId(1));
  EXPECT_EQ(report.published->roots(), (std::vector{KeyframeId(0), KeyframeId(1)}));  // each is the root of a submap
  EXPECT_EQ(report.published->check_invariants().value_or("valid"), "valid");
}

TEST(MapStore, FreesRemovedLandmarksAlsoWhenRebasedButNotInOldSnapshots) {
  Random random(1);
  MapStore store{BundledMap(synthetic_rig(1))};
  MapDraft made(store.snapshot());
  const KeyframeId k = made.add_keyframe(synthetic_frame(random, 1, 40, 0), {}, {}, {});
  for (int i = 0; i < 40; ++i) made.add_landmark({0, 0, 5}, {{k, FeatureId(i)}});
  store.commit(std::move(made));
  const MapSnapshot reader = store.snapshot();
  MapDraft first(reader), second(reader);
  for (int i = 0; i < 32; ++i) (i < 16 ? first : second).remove_landmark(LandmarkId(i));
  store.commit(std::move(first));
  const CommitReport report = store.commit(std::move(second));
  EXPECT_TRUE(report.rebased);
  const auto freed = [](const BundledMap& map) {
    return &map.landmark(LandmarkId(0)) == &map.landmark(LandmarkId(16));
  };
  EXPECT_TRUE(freed(*report.published));
  EXPECT_FALSE(freed(*reader));
  EXPECT_EQ(reader->landmark(LandmarkId(3)).position, Eigen::Vector3d(0, 0, 5));
  EXPECT_EQ(report.published->check_invariants().value_or("valid"), "valid");
}

TEST(MapStore, ServesReadersWhileTwoThreadsCommit) {
  constexpr int kCommits = 60;
  MapStore store{BundledMap(synthetic_rig(2))};
  std::atomic<int> writers = 2, rejected = 0;  // corrections rejected because of another correction
  const auto write = [&](std::uint64_t seed) {
    RandomEditor editor(seed);
    for (int i = 0; i < kCommits; ++i) {
      MapDraft draft(store.snapshot());
      for (int n = 0; n < 20; ++n) editor.change(draft);
      rejected += store.commit(std::move(draft)).rejected;
    }
    --writers;
  };
  std::vector<std::string> broken;
  MapVersion last = store.snapshot()->version();
  {
    std::jthread tracker(write, 1), mapper(write, 2);
    while (writers > 0) {
      const MapSnapshot snapshot = store.snapshot();
      if (snapshot->version() < last) broken.push_back("versions go back");
      last = snapshot->version();
      if (const auto rule = snapshot->check_invariants()) broken.push_back(*rule);
      const BundledMap copy = *snapshot;  // copied while other threads copy
      if (copy.num_landmarks() != snapshot->num_landmarks()) broken.push_back("a copy differs");
    }
  }
  EXPECT_TRUE(broken.empty()) << broken.front();
  EXPECT_EQ(store.snapshot()->version(), MapVersion(2 * kCommits - rejected));
  EXPECT_EQ(store.snapshot()->check_invariants().value_or("valid"), "valid");
}

}  // namespace
}  // namespace bslam::map
