#include "execution/stage.h"

#include <gtest/gtest.h>

#include "execution/stage_world.h"

namespace bslam::execution {
namespace {

TEST(Stage, OnlyAResultThatWillBeCommittedSupersedesOthers) {
  const Superseded none, global{{Stage::kGlobal}, {}}, all{{Stage::kGlobal}, {Stage::kCalibrate}};
  const StageWorld world;
  map::MapStore store{world.empty_map()};
  store.commit(world.with_keyframe(FrameId(0), store.snapshot()));
  const auto superseded = [&](Stage stage, const StageResult& result) {
    return superseded_by(stage, result, *store.snapshot());
  };
  const StageResult nothing, fusion{map::MapDraft(store.snapshot()), {}};
  StageResult correction = fusion;
  ASSERT_TRUE(correction.draft->scale_submap(KeyframeId(0), 2));
  EXPECT_EQ(superseded(Stage::kLoop, nothing), none);
  EXPECT_EQ(superseded(Stage::kLoop, fusion), global);
  EXPECT_EQ(superseded(Stage::kLoop, correction), all);
  EXPECT_EQ(superseded(Stage::kCalibrate, correction), global);
  EXPECT_EQ(superseded(Stage::kMap, correction), none);
  EXPECT_EQ(superseded(Stage::kGlobal, correction), none);
  map::MapDraft other = *correction.draft;
  store.commit(std::move(other));
  EXPECT_EQ(superseded(Stage::kLoop, correction), none);  // its commit will be rejected
}

TEST(Stage, OnlyAdjustmentsCanBeDropped) {
  for (const Stage stage : kStages) EXPECT_EQ(can_be_dropped(stage), stage == Stage::kGlobal) << stage_name(stage);
}

TEST(Stage, FramesAwaitTheFirstCalibrations) {
  const StageWorld world;
  map::BundledMap empty = world.empty_map();
  EXPECT_TRUE(awaited({Stage::kMap, KeyframeId(3)}, empty));
  EXPECT_TRUE(awaited({Stage::kKeyframe, KeyframeId(), FrameId(3)}, empty));
  EXPECT_TRUE(awaited({Stage::kCalibrate, KeyframeId(4)}, empty));
  EXPECT_TRUE(awaited({Stage::kCalibrate, KeyframeId(12)}, empty));
  EXPECT_FALSE(awaited({Stage::kCalibrate, KeyframeId(18)}, empty));
  EXPECT_FALSE(awaited({Stage::kLoop, KeyframeId(3)}, empty));
  EXPECT_FALSE(awaited({Stage::kGlobal, KeyframeId(3)}, empty));
}

TEST(Stage, KeyframesOfADiscardedMapDoNotCount) {
  const StageWorld world;
  map::MapStore store{world.empty_map()};
  for (int i = 0; i < 20; ++i) store.commit(world.with_keyframe(FrameId(i), store.snapshot()));
  EXPECT_EQ(calibration_due(KeyframeId(12), *store.snapshot()), 2);
  EXPECT_FALSE(calibration_due(KeyframeId(28), *store.snapshot()).has_value());
  EXPECT_FALSE(calibration_uncertain(KeyframeId(24), *store.snapshot()));
  EXPECT_TRUE(calibration_compared(*store.snapshot()));
  store.restart();
  store.commit(world.with_keyframe(FrameId(20), store.snapshot()));
  ASSERT_EQ(store.snapshot()->newest_keyframe(), KeyframeId(20));
  EXPECT_EQ(calibration_due(KeyframeId(24), *store.snapshot()), 0);
  EXPECT_EQ(calibration_due(KeyframeId(28), *store.snapshot()), 1);
  EXPECT_FALSE(calibration_due(KeyframeId(23), *store.snapshot()).has_value());
  EXPECT_TRUE(calibration_uncertain(KeyframeId(24), *store.snapshot()));
  EXPECT_FALSE(calibration_compared(*store.snapshot()));
  EXPECT_TRUE(awaited({Stage::kCalibrate, KeyframeId(28)}, *store.snapshot()));
}

}  // namespace
}  // namespace bslam::execution
