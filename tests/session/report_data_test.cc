#include "session/report_data.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "evaluation/association.h"
#include "evaluation/trajectory_file.h"
#include "map/synthetic_map.h"
#include "session/report_arrays.h"
#include "session/report_loops.h"
#include "session/report_map.h"
#include "session/report_truth.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

using geometry::SE3;
using geometry::Vector3d;

TEST(ReportArrays, AreBase64OfLittleEndianFloats) {
  EXPECT_EQ(float_array({}).dump(), R"({"f32":""})");
  EXPECT_EQ(float_array(std::vector<float>{1.0F}).dump(), R"({"f32":"AACAPw=="})");
  EXPECT_EQ(float_array(std::vector<float>{1.0F, -2.0F}).dump(), R"({"f32":"AACAPwAAAMA="})");
  EXPECT_EQ(float_array(std::vector<float>{1.0F, -2.0F, 0.5F}).dump(), R"({"f32":"AACAPwAAAMAAAAA/"})");
}

TEST(ReportArrays, AreThinnedToTheLimit) {
  EXPECT_EQ(report_stride(0, 10), 1u);
  EXPECT_EQ(report_stride(10, 10), 1u);
  EXPECT_EQ(report_stride(11, 10), 2u);
  EXPECT_EQ(report_stride(1'000'000, 100'000), 10u);
}

TEST(ReportRig, LimitsTheRaysOfWideFieldsOfView) {
  const auto rig = report_rig(synthetic::ring_rig(3, 240));
  ASSERT_EQ(rig.size(), 3u);
  for (const auto& camera : rig) {
    ASSERT_EQ(camera["corners"].size(), 4u);
    for (const auto& ray : camera["corners"]) EXPECT_LT(std::hypot(double(ray[0]), double(ray[1])), 3.0);
  }
}

TEST(ReportLoops, JoinTheNearestKeyframesOfTheirSubmap) {
  const std::vector<std::vector<float>> times = {{0, 1, 1, 2.5F, 4}, {}, {10, 11, 12}};
  const std::vector<PlaceEvent> loops = {{4, 1, 80}, {12.4, 9, 50}, {11, 2.5, 60}, {1.2, 5, 40}};
  const std::vector<ReportLoop> found = report_loops(loops, times);
  ASSERT_EQ(found.size(), 3u);  // the ends of the third one are in different submaps
  EXPECT_EQ(found[0].submap, 0u);
  EXPECT_EQ(found[0].at, 4u);
  EXPECT_EQ(found[0].with, 2u);
  EXPECT_EQ(found[1].submap, 2u);
  EXPECT_EQ(found[1].at, 2u);
  EXPECT_EQ(found[1].with, 0u);
  EXPECT_EQ(found[2].at, 2u);
  EXPECT_EQ(found[2].with, 4u);
  EXPECT_TRUE(report_loops(loops, {}).empty());
}

// A map to which an earlier recording was added after a later one.
TEST(ReportSubmaps, ListKeyframesInOrderOfTimeWithTheirLoops) {
  map::BundledMap map(map::synthetic_rig(2));
  Random random(1, "report");
  KeyframeId parent;
  for (const TimeNs seconds : {5, 6, 2, 3}) {
    frame::BundledFrame frame = *map::synthetic_frame(random, 2, 20, 5);
    frame.time_ns = seconds * 1'000'000'000;
    const SE3 T_rig_world(Eigen::Quaterniond::Identity(), Vector3d(double(-seconds), 0, 0));
    parent = map.add_keyframe(std::make_shared<const frame::BundledFrame>(std::move(frame)), T_rig_world, {}, parent);
  }
  const std::vector<PlaceEvent> loops = {{6, 2, 90}};
  const auto submaps = report_submaps(map, {.paths = {}, .loops = loops});
  ASSERT_EQ(submaps.size(), 1u);
  EXPECT_EQ(submaps[0]["keyframes"]["time"], float_array(std::vector<float>{2, 3, 5, 6}));
  EXPECT_EQ(submaps[0]["keyframes"]["position"],
            float_array(std::vector<float>{2, -0.0F, -0.0F, 3, -0.0F, -0.0F, 5, -0.0F, -0.0F, 6, -0.0F, -0.0F}));
  EXPECT_EQ(submaps[0]["loops"], nlohmann::ordered_json::parse("[[3, 0]]"));
}

// A path along x, and its ground truth of the body in KITTI's or TUM's format.
struct Path {
  dataset::Dataset dataset{.name = "path",
                           .format = dataset::DatasetFormat::kEuroc,
                           .rig = synthetic::ring_rig(1, 240),
                           .cameras_used = {0},
                           .whole_rig = {},
                           .first_time_ns = 1'000'000'000,
                           .frames = {},
                           .ground_truth = {},
                           .warnings = {}};
  evaluation::Trajectory poses;

  Path() {
    for (TimeNs i = 0; i < 20; ++i)
      poses.push_back({1'000'000'000 + i * 100'000'000,
                       SE3(Eigen::Quaterniond::Identity(), Vector3d(double(i), double(i % 3), 0))});
  }
};

TEST(ReportTruth, IsNullWithoutGroundTruth) {
  const Path path;
  EXPECT_TRUE(report_truth(path.dataset, path.poses, true).is_null());
}

TEST(ReportTruth, ExplainsWhyItCannotBeUsed) {
  const support::TemporaryFolder folder;
  Path path;
  path.dataset.ground_truth = folder.path() / "missing.tum";
  EXPECT_NE(std::string(report_truth(path.dataset, path.poses, true)["error"]).find("missing.tum"), std::string::npos);
  support::write_text(folder.path() / "elsewhere.tum", "500 0 0 0 0 0 0 1\n501 1 0 0 0 0 0 1\n");
  path.dataset.ground_truth = folder.path() / "elsewhere.tum";
  EXPECT_TRUE(report_truth(path.dataset, path.poses, true).contains("error"));
}

TEST(ReportTruth, IsMovedFromTheBodyToCamera0) {
  const support::TemporaryFolder folder;
  Path path;
  const auto body = evaluation::moved_to_frame(path.poses, path.dataset.rig.body_from_cam(0).inverse());
  support::write_text(folder.path() / "truth.tum", evaluation::tum_text(body, ""));
  path.dataset.ground_truth = folder.path() / "truth.tum";
  const auto truth = report_truth(path.dataset, path.poses, true);
  EXPECT_EQ(truth["ate_m"]["count"], 20);
  EXPECT_LT(double(truth["ate_m"]["rmse"]), 1e-6);
  EXPECT_EQ(truth["file"], "truth.tum");

  // Of unknown scale, the path agrees with the ground truth after alignment of the scale.
  for (evaluation::TimedPose& pose : path.poses) pose.T_world_frame = geometry::scaled(pose.T_world_frame, 0.1);
  const auto scaled = report_truth(path.dataset, path.poses, false);
  EXPECT_LT(double(scaled["ate_m"]["rmse"]), 1e-6);
  EXPECT_NEAR(double(scaled["scale"]), 10.0, 1e-6);
}

TEST(ReportTruth, SaysThatACalibrationHasNoBody) {
  const support::TemporaryFolder folder;
  Path path;
  support::write_text(folder.path() / "truth.tum", evaluation::tum_text(path.poses, ""));
  path.dataset.ground_truth = folder.path() / "truth.tum";
  EXPECT_TRUE(report_truth(path.dataset, path.poses, true)["note"].is_null());
  path.dataset.rig = camera::Rig({{path.dataset.rig.camera(0u), SE3()}});
  const auto note = report_truth(path.dataset, path.poses, true)["note"];
  ASSERT_TRUE(note.is_string());
  EXPECT_NE(std::string(note).find("is taken to be camera 0"), std::string::npos);
  path.dataset.format = dataset::DatasetFormat::kKitti;  // whose poses are those of image_0
  EXPECT_TRUE(report_truth(path.dataset, path.poses, true)["note"].is_null());
}

TEST(ReportTruth, CountsWhileTheRecordingWasProcessed) {
  const support::TemporaryFolder folder;
  Path path;
  support::write_text(folder.path() / "truth.tum", evaluation::tum_text(path.poses, ""));
  path.dataset.ground_truth = folder.path() / "truth.tum";
  for (std::size_t i = 0; i < 10; ++i) path.dataset.frames.push_back({path.poses[i].time_ns, {}});
  path.poses.resize(10);
  EXPECT_NEAR(double(report_truth(path.dataset, path.poses, true)["coverage"]), 1.0, 1e-9);
  path.poses.resize(5);
  EXPECT_NEAR(double(report_truth(path.dataset, path.poses, true)["coverage"]), 0.5, 1e-9);
  const TimeNs interrupted_ns = path.poses.back().time_ns;
  EXPECT_NEAR(double(report_truth(path.dataset, path.poses, true, interrupted_ns)["coverage"]), 1.0, 1e-9);
}

}  // namespace
}  // namespace bslam::session
