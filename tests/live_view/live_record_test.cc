#include "live_view/live_record.h"

#include <gtest/gtest.h>

#include <memory>
#include <tuple>

#include "synthetic/rigs.h"

namespace bslam::live_view {
namespace {

using tracking::FrameRecord;
using tracking::TrackStatus;

constexpr TimeNs kInterval = 50'000'000;
constexpr std::size_t kCameras = 4;

// A frame as a run of four cameras reports it.
FrameRecord tracked(int index) {
  FrameRecord out;
  out.result.frame = FrameId(index);
  out.result.time_ns = index * kInterval;
  out.result.status = TrackStatus::kTracking;
  out.result.reason = tracking::LostReason::kNone;
  out.result.anchored = {KeyframeId(0), geometry::SE3(geometry::Quaterniond::Identity(), {0, 0, -0.1 * index}), 1.0};
  out.result.covariance = geometry::Matrix6d::Identity();
  out.result.cameras.assign(kCameras, {.keypoints = 300, .matched = 200, .inliers = 150});
  out.images.assign(kCameras, image::ImageState::kPresent);
  out.cameras.assign(kCameras, {});
  for (const char* stage : {"pyramid", "extract", "bundle", "match", "pose", "align", "keyframe", "publish"})
    out.stages.push_back({stage, 0.5});
  out.frame_ms = 12.5;
  return out;
}

dataset::Dataset recording() {
  return {.name = "live",
          .format = {},
          .rig = synthetic::default_rig(),
          .cameras_used = {0, 1, 2, 3},
          .whole_rig = {},
          .first_time_ns = 0,
          .frames = {},
          .ground_truth = {},
          .warnings = {}};
}

map::BundledMap one_keyframe() {
  map::BundledMap map(std::make_shared<const camera::Rig>(synthetic::default_rig()));
  auto frame = std::make_shared<frame::BundledFrame>();
  frame->cameras.resize(kCameras);
  map.add_keyframe(frame, geometry::SE3(), {}, KeyframeId());
  return map;
}

// Before a browser is connected, nothing else of a frame is kept.
TEST(FrameLog, KeepsAFewHundredBytesOfEveryFrame) {
  FrameLog log(kCameras);
  for (int i = 0; i < 1000; ++i) {
    const FrameRecord record = tracked(i);
    log.add({record.result.time_ns, &record, 1.0, 0});
  }
  EXPECT_LE(log.memory_bytes(), 1000u * 256u);
  EXPECT_GE(sizeof(FrameRecord), 512u) << "what was kept before, without the memory of its vectors";
}

TEST(FrameLog, KeepsWhatIsShown) {
  FrameLog first(kCameras), log(kCameras);
  FrameRecord record = tracked(3);
  record.keyframe = record.direct = record.result.contest.contested = true;
  record.reduction = 2;
  record.unique = 900, record.monocular = 600, record.matched = 300;
  record.images[1] = image::ImageState::kDamaged;
  record.cameras[2] = {tracking::CameraState::kOut, tracking::CameraReason::kBlack};
  record.relocalisation = {KeyframeId(0), 77};
  first.add({0, nullptr, 2.5, 0});
  FrameLog second(kCameras);
  second.add({record.result.time_ns, &record, 1.5, kInterval});
  log.append(std::move(first));
  log.append(std::move(second));
  ASSERT_EQ(log.size(), 2u);
  EXPECT_FALSE(log.record(0));
  EXPECT_FALSE(log.tracked(0));
  EXPECT_EQ(log.read_ms(0), 2.5F);
  const auto kept = log.record(1);
  ASSERT_TRUE(kept);
  EXPECT_TRUE(kept->keyframe && kept->direct && kept->result.contest.contested && log.tracked(1));
  EXPECT_EQ(kept->reduction, 2);
  EXPECT_EQ(std::tuple(kept->unique, kept->monocular, kept->matched), std::tuple(900, 600, 300));
  EXPECT_EQ(kept->images, record.images);
  EXPECT_EQ(kept->cameras, record.cameras);
  EXPECT_EQ(kept->result.cameras[3].inliers, 150);
  EXPECT_EQ(kept->frame_ms, 12.5);
  EXPECT_NEAR(log.pose(1).T_rig_reference.translation().z(), -0.3, 1e-6);
  ASSERT_EQ(log.stages(1).size(), 8u);
  EXPECT_EQ(log.stages(1)[7].name, "publish");
  ASSERT_EQ(log.relocalised().size(), 1u);
  EXPECT_EQ(log.relocalised()[0].inliers, 77);
}

TEST(LiveRecord, ShowsTheWholePathToABrowserThatConnectsLate) {
  const dataset::Dataset dataset = recording();
  LiveRecord live(dataset, {}, 0);
  FrameLog log(kCameras);
  for (int i = 0; i < 40; ++i) {
    const FrameRecord record = tracked(i);
    log.add({i * kInterval, i == 5 ? nullptr : &record, 1.0, 0});
  }
  live.append(std::move(log));
  const map::BundledMap map = one_keyframe();
  for (int twice = 0; twice < 2; ++twice) {
    const auto json = live.run_json(map, dataset.rig, {}, std::nullopt);
    EXPECT_EQ(json["summary"]["frames"]["input"], 40);
    EXPECT_EQ(json["summary"]["frames"]["tracked"], 39);
    EXPECT_EQ(json["summary"]["frames"]["dropped"], 1);
    EXPECT_EQ(json["summary"]["cameras"][3]["images"], 39);
    EXPECT_EQ(json["summary"]["time"]["stages_ms"]["read"]["count"], 40);
    EXPECT_EQ(json["summary"]["time"]["stages_ms"]["publish"]["count"], 39);
    EXPECT_EQ(json["submaps"][0]["frames"], 39);
  }
}

TEST(LiveRecord, DiscardsThePosesOfAMapThatWasWithdrawn) {
  const dataset::Dataset dataset = recording();
  LiveRecord live(dataset, {}, 0);
  for (int i = 0; i < 10; ++i) {
    FrameRecord record = tracked(i);
    record.map_withdrawn = i == 6;
    FrameLog log(kCameras);
    log.add({i * kInterval, &record, 1.0, 0});
    live.append(std::move(log));
  }
  const auto json = live.run_json(one_keyframe(), dataset.rig, {}, std::nullopt);
  EXPECT_EQ(json["summary"]["frames"]["tracked"], 4);
  EXPECT_EQ(json["summary"]["frames"]["lost"], 6);
}

}  // namespace
}  // namespace bslam::live_view
