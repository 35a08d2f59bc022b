#include "session/summary.h"

#include <gtest/gtest.h>

#include <cmath>

#include "session/memory_report.h"

namespace bslam::session {
namespace {

using nlohmann::ordered_json;

std::vector<std::string> keys(const ordered_json& json) {
  std::vector<std::string> names;
  for (const auto& item : json.items()) names.push_back(item.key());
  return names;
}

using tracking::LostReason;

// A frame with a pose, or one that was lost.
RunFrame frame(double time_s, LostReason reason = LostReason::kNone) {
  tracking::FrameRecord record;
  const bool tracked = reason == LostReason::kNone;
  record.result.status = tracked ? tracking::TrackStatus::kTracking : tracking::TrackStatus::kLost;
  record.result.reason = reason;
  return {time_s, record};
}

RunFrame dropped(double time_s) { return {time_s, std::nullopt}; }

TEST(Summary, HasTheDocumentedKeysInOrder) {
  RunRecord record;
  record.cameras = {
      {"cam0", 400, 1, {{{tracking::CameraState::kDegraded, tracking::CameraReason::kBlurred}, 0.0, 1.5}}}};
  record.loops = {{43.1, 1.2, 83}};
  record.relocalisations = {{12.4, 3.15, 60}};
  record.frames = {frame(1.25, LostReason::kFewMatches)};
  record.warnings = {"cam0: blurred"};
  add_stage_sample(record, "extract", StageThread::kCaller, {0.0, 9.1});
  const ordered_json json = summary_json(record);
  EXPECT_EQ(keys(json),
            (std::vector<std::string>{
                "schema",       "version", "complete",    "data",     "mode",   "seed",    "cameras_used",
                "frames",       "cameras", "calibration", "features", "map",    "loops",   "relocalisations",
                "maps_started", "parts",   "time",        "work",     "memory", "warnings"}));
  EXPECT_EQ(json["warnings"].dump(), R"(["cam0: blurred"])");
  EXPECT_EQ(keys(json["frames"]), (std::vector<std::string>{"input", "tracked", "lost", "dropped", "in_loaded_map",
                                                            "lost_intervals", "reduced_work", "contested_intervals"}));
  EXPECT_EQ(json["frames"]["lost_intervals"].dump(), R"([{"from":1.25,"to":1.25,"reason":"too few matches"}])");
  EXPECT_EQ(json["frames"]["reduced_work"], ordered_json::array());
  EXPECT_EQ(json["frames"]["contested_intervals"], ordered_json::array());
  EXPECT_EQ(json["cameras"].dump(),
            R"([{"name":"cam0","images":400,"skipped":1,)"
            R"("states":[{"state":"degraded","reason":"blurred","from":0.0,"to":1.5}],)"
            R"("reprojection":{"rms_px":null,"observations":0,"inlier_share":null},"extrinsics":null}])");
  EXPECT_EQ(keys(json["features"]),
            (std::vector<std::string>{"keypoints_per_image", "unique", "monocular", "matched"}));
  EXPECT_EQ(json["map"].dump(),
            R"({"keyframes":0,"landmarks":0,"observations":0,"scale":"metric","scale_std":null,"loaded":false})");
  EXPECT_EQ(json["loops"].dump(), R"([{"at":43.1,"with":1.2,"inliers":83}])");
  EXPECT_EQ(json["relocalisations"].dump(), R"([{"at":12.4,"with":3.15,"inliers":60}])");
  EXPECT_EQ(keys(json["time"]), (std::vector<std::string>{"start_up_s", "wall_s", "cpu_s", "frame_ms", "stages_ms"}));
  EXPECT_EQ(json["time"]["stages_ms"].dump(),
            R"({"extract":{"median":9.1,"p95":9.1,"max":9.1,"count":1,"total":9.1}})");
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["work"].dump(),
            R"({"frames":1,"keyframes":0,"landmarks":0,"observations":0,"images_extracted":0,"features_extracted":0,)"
            R"("solver_steps":0,"allocations":null})");
  EXPECT_EQ(json["memory"].dump(), R"({"peak_mb":null})");
}

TEST(Summary, ReportsFramesTimesAndFileOfEverySubmap) {
  RunRecord record;
  EXPECT_EQ(summary_json(record)["parts"], ordered_json::array());
  record.map.loaded = true;
  record.maps_started = 2;
  record.submaps = {{60, 0.05, 7.5, "trajectory.tum"}, {12, 4.0, 5.25, "trajectory_part2.tum", true}};
  const ordered_json json = summary_json(record);
  EXPECT_EQ(json["map"]["loaded"], true);
  EXPECT_EQ(json["frames"]["in_loaded_map"], 12);
  EXPECT_EQ(json["maps_started"], 2);
  EXPECT_EQ(json["parts"].dump(),
            R"([{"frames":60,"from":0.05,"to":7.5,"loaded":false,"trajectory":"trajectory.tum"},)"
            R"({"frames":12,"from":4.0,"to":5.25,"loaded":true,"trajectory":"trajectory_part2.tum"}])");
}

// An estimate of the calibration is neither offered after an interruption nor if the images belong to another rig.
TEST(Summary, CalibrationIsRefinedOnlyByAnEstimateThatApplies) {
  CalibrationRecord calibration;
  calibration.accept_estimate(true, true);
  EXPECT_FALSE(calibration.refined);  // a run that was stopped before its last estimate
  calibration.estimate.done = true;
  calibration.estimate.verdict = calibration::Verdict::kConsistent;
  calibration.accept_estimate(false, true);
  EXPECT_FALSE(calibration.refined);
  calibration.accept_estimate(true, true);
  EXPECT_TRUE(calibration.refined);
  EXPECT_EQ(calibration.verdict(), calibration::Verdict::kConsistent);
  calibration.disagreeing = {1};
  EXPECT_EQ(calibration.verdict(), calibration::Verdict::kUnknown);
  calibration.accept_estimate(true, true);
  EXPECT_FALSE(calibration.applies);  // the cameras disagree as a whole
  EXPECT_FALSE(calibration.refined);
  calibration.pairs = {{.first = 0, .second = 1}};
  EXPECT_EQ(calibration.verdict(), calibration::Verdict::kUnknown);
  calibration.pairs.front().contradicted = true;
  calibration.accept_estimate(true, true);
  EXPECT_FALSE(calibration.refined);
  EXPECT_EQ(calibration.verdict(), calibration::Verdict::kInconsistent);
}

TEST(Summary, CountsFramesByOutcome) {
  RunRecord record;
  record.frames = {frame(0), frame(1), dropped(2), frame(3, LostReason::kFewInliers)};
  const ordered_json json = summary_json(record)["frames"];
  EXPECT_EQ(json["input"], 4);
  EXPECT_EQ(json["tracked"], 2);
  EXPECT_EQ(json["lost"], 1);
  EXPECT_EQ(json["dropped"], 1);
}

TEST(LostIntervals, JoinConsecutiveLostFrames) {
  using enum LostReason;
  RunRecord record;
  record.frames = {frame(0.0, kNotStarted),
                   frame(0.1),
                   frame(0.2, kFewMatches),
                   dropped(0.3),
                   frame(0.4, kNotFound),
                   frame(0.5),
                   dropped(0.6),
                   frame(0.7, kNoImages)};
  const auto intervals = lost_intervals(record);
  ASSERT_EQ(intervals.size(), 3u);
  EXPECT_EQ(intervals[0].to_s, 0.0);
  EXPECT_EQ(intervals[1].from_s, 0.2);
  EXPECT_EQ(intervals[1].to_s, 0.4);
  EXPECT_EQ(intervals[1].reason, "too few matches");
  EXPECT_EQ(intervals[2].from_s, 0.7);
  EXPECT_TRUE(lost_intervals({}).empty());
}

RunFrame contested(double time_s) {
  RunFrame out = frame(time_s);
  out.record->result.contest.contested = true;
  return out;
}

TEST(ContestedIntervals, HaveFiveContestedFramesWithinASecond) {
  RunRecord record;
  for (const double time_s : {0.0, 0.5, 1.5, 2.0, 2.6}) record.frames.push_back(contested(time_s));  // in 2.6 s
  EXPECT_TRUE(contested_intervals(record).empty());
  for (const double time_s : {10.0, 10.1, 10.25, 10.5}) record.frames.push_back(contested(time_s));
  record.frames.push_back(frame(10.75));
  EXPECT_TRUE(contested_intervals(record).empty());
  for (const double time_s : {11.0, 11.05}) record.frames.push_back(contested(time_s));  // 10.1 - 11.05 also
  for (const double time_s : {20.0, 20.25, 20.5, 20.75}) record.frames.push_back(contested(time_s));
  record.frames.push_back(dropped(20.9));
  record.frames.push_back(contested(21.0));
  const auto intervals = contested_intervals(record);
  ASSERT_EQ(intervals.size(), 2u);
  EXPECT_EQ(intervals[0].from_s, 10.0);
  EXPECT_EQ(intervals[0].to_s, 11.05);
  EXPECT_EQ(intervals[0].frames, 6);
  EXPECT_EQ(intervals[1].from_s, 20.0);
  EXPECT_EQ(intervals[1].to_s, 21.0);
  EXPECT_EQ(intervals[1].frames, 5);
}

TEST(CameraIntervals, MergeEqualConsecutiveStatuses) {
  using tracking::CameraReason, tracking::CameraState;
  const tracking::CameraStatus ok, black{CameraState::kOut, CameraReason::kBlack},
      blurred{CameraState::kOut, CameraReason::kBlurred};
  std::vector<RunFrame> frames;
  for (const tracking::CameraStatus status : {ok, ok, black, black, blurred, ok}) {
    frames.push_back(frame(0.1 * static_cast<double>(frames.size())));
    frames.back().record->cameras = {ok, status};
    frames.push_back(dropped(frames.back().time_s + 0.05));
  }
  const auto intervals = camera_intervals(frames, 1);
  ASSERT_EQ(intervals.size(), 4u);
  EXPECT_EQ(intervals[1].status, black);
  EXPECT_EQ(intervals[1].from_s, frames[4].time_s);
  EXPECT_EQ(intervals[1].to_s, frames[6].time_s);
  EXPECT_EQ(intervals[2].status, blurred);
  EXPECT_EQ(intervals[3].status, ok);
  EXPECT_EQ(camera_intervals(frames, 0).size(), 1u);
}

TEST(Summary, AveragesFeaturesOverFramesAndImages) {
  RunRecord record;
  RunFrame first = frame(0), second = frame(1, LostReason::kFewInliers);
  using enum image::ImageState;
  first.record->images = {kPresent, kPresent};
  first.record->result.cameras = {{1000, 0, 0}, {600, 0, 0}};
  first.record->unique = 1500;
  first.record->monocular = 1400;
  first.record->matched = 100;
  second.record->images = {kPresent, kMissing};
  second.record->result.cameras = {{500, 0, 0}, {0, 0, 0}};
  second.record->unique = second.record->monocular = 500;
  record.frames = {first, second, dropped(2)};
  EXPECT_EQ(summary_json(record)["features"].dump(),
            R"({"keypoints_per_image":700.0,"unique":1000.0,"monocular":950.0,"matched":50.0})");
}

TEST(DurationStatistics, AgreeWithNumpyPercentile) {
  std::vector<double> values;
  for (int i = 20; i >= 1; --i) values.push_back(i);
  const DurationStatistics s = duration_statistics(values);
  EXPECT_DOUBLE_EQ(s.median, 10.5);
  EXPECT_DOUBLE_EQ(s.p95, 19.05);
  EXPECT_DOUBLE_EQ(s.max, 20.0);
  EXPECT_EQ(s.count, 20u);
  EXPECT_TRUE(std::isnan(duration_statistics({}).median));
}

TEST(Summary, IsNullIfNothingWasMeasured) {
  const ordered_json json = summary_json({});
  EXPECT_TRUE(json["time"]["frame_ms"]["median"].is_null());
  EXPECT_TRUE(json["features"]["unique"].is_null());
  EXPECT_EQ(json["frames"]["lost_intervals"], ordered_json::array());
  EXPECT_EQ(json["time"]["stages_ms"], ordered_json::object());
}

TEST(Summary, ListsThePartsOfTheMemoryIfTheyWereMeasured) {
  RunRecord record;
  record.memory = {.parts = {{"vocabulary", 17.0, {}}, {"images read ahead", 0.0, 2.5}}, .resident_mb = 80.0};
  record.work.allocations = 1234;
  const ordered_json json = summary_json(record);
  EXPECT_EQ(json["memory"].dump(),
            R"({"peak_mb":null,"resident_mb":80.0,"report":[{"part":"vocabulary","mb":17.0,"largest_mb":null},)"
            R"({"part":"images read ahead","mb":0.0,"largest_mb":2.5}]})");
  EXPECT_EQ(json["work"]["allocations"], 1234);
  EXPECT_EQ(memory_text(record),
            "memory at the end of the run\n"
            "part                               MB  largest MB\n"
            "vocabulary                      17.00\n"
            "images read ahead                0.00        2.50\n"
            "rest: program, libraries, heap  63.00\n"
            "process                         80.00\n");
}

TEST(Summary, WritesValidJsonForAnyName) {
  RunRecord record;
  record.data = "bad \xFF name \"quoted\"";
  record.peak_memory_mb = 210.44;
  record.wall_s = 0.1 + 0.2;
  const std::string text = summary_text(record);
  EXPECT_EQ(text.back(), '\n');
  const ordered_json json = ordered_json::parse(text);
  EXPECT_EQ(json["memory"]["peak_mb"], 210.4);
  EXPECT_EQ(json["time"]["wall_s"], 0.3);
}

}  // namespace
}  // namespace bslam::session
