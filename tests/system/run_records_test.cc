#include "system/run_records.h"

#include <gtest/gtest.h>

namespace bslam::system {
namespace {

TEST(RunRecords, ADiscardedMapTakesItsLoopsAndNewKeyframesWithIt) {
  RunRecords records;
  records.set_keyframe_time(KeyframeId(0), 100);
  records.add_deferred(FrameId(7), 700);
  EXPECT_TRUE(records.creates_keyframes());
  records.add_created({FrameId(7), KeyframeId(1)}, 700);
  records.add_stage_run({{execution::Stage::kKeyframe, KeyframeId(1), FrameId(7)}, 3.0, true});
  records.add_stage_run({{execution::Stage::kLoop, KeyframeId(1)}, 2.0, true});
  records.add_loop({.closure = {KeyframeId(1), KeyframeId(0)}, .time_ns = 700, .with_time_ns = 100});
  EXPECT_EQ(records.loops().size(), 1u);
  records.discard_map();
  EXPECT_TRUE(records.loops().empty());
  EXPECT_TRUE(records.take_created().empty());
  EXPECT_FALSE(records.creates_keyframes());
  ASSERT_EQ(records.stage_runs().size(), 2u);  // their time was spent
  for (const StageRecord& run : records.stage_runs()) EXPECT_EQ(run.time_ns, 700);
}

TEST(RunRecords, OldStageRunsAreDropped) {
  RunRecords records;
  for (int k = 0; k < 5; ++k) {
    records.set_keyframe_time(KeyframeId(k), k);
    records.add_stage_run({{execution::Stage::kMap, KeyframeId(k)}, 1.0, true});
  }
  records.keep_latest(7);
  EXPECT_EQ(records.stage_runs().size(), 5u);
  records.keep_latest(2);
  ASSERT_EQ(records.stage_runs().size(), 2u);
  EXPECT_EQ(records.stage_runs().front().time_ns, 3);
  EXPECT_EQ(records.keyframe_time(KeyframeId(0)), 0);
}

TEST(RunRecords, CreatedKeyframesAreTakenOnce) {
  RunRecords records;
  records.add_created({FrameId(3), KeyframeId(2)}, 300);
  EXPECT_EQ(records.keyframe_time(KeyframeId(2)), 300);
  EXPECT_EQ(records.take_created(), (std::vector<tracking::CreatedKeyframe>{{FrameId(3), KeyframeId(2)}}));
  EXPECT_FALSE(records.creates_keyframes());
}

}  // namespace
}  // namespace bslam::system
