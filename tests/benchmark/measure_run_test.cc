#include "benchmark/measure_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "benchmark/benchmark_report.h"
#include "evaluation/association.h"
#include "evaluation/trajectory_file.h"
#include "geometry/so3.h"
#include "support/data_on_disk.h"

namespace bslam::benchmark {
namespace {

using evaluation::Trajectory;

// A turning body with a camera that is 0.1 m away from its origin.
class MeasureRun : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 100; ++i) {
      const double a = 0.06 * i;
      const geometry::SE3 T_world_body(geometry::so3_exp({0, 0, a}),
                                       geometry::Vector3d(std::cos(a), 2 * std::sin(a), 0.1 * std::sin(3 * a)));
      body_.push_back({TimeNs{1'000'000'000} + i * TimeNs{50'000'000}, T_world_body});
    }
    camera_ = evaluation::moved_to_frame(body_, body_from_camera_);
    const auto& run = folder_.path();
    support::write_text(run / "trajectory.tum", evaluation::tum_text(camera_, ""));
    support::write_text(run / "trajectory_live.tum", evaluation::tum_text(camera_, ""));
    support::write_text(run / "summary.json",
                        R"({"frames": {"input": 110, "tracked": 100}, "loops": [{}], "parts": [{}, {}],
                            "time": {"frame_ms": {"median": 3.5, "p95": 7.0}}, "memory": {"peak_mb": 80}})");
    support::write_text(run / "truth.csv", evaluation::euroc_csv_text(body_));
  }

  Sequence with_body_truth() const {
    return {.name = "s", .folder = {}, .released = Truth{folder_.path() / "truth.csv"}, .corrected = {}, .rig = {}};
  }

  support::TemporaryFolder folder_;
  const geometry::SE3 body_from_camera_{geometry::so3_exp({0.1, -0.4, 1.2}), geometry::Vector3d(0.06, 0.08, 0.0)};
  Trajectory body_, camera_;
};

TEST_F(MeasureRun, ProtocolTRemovesThePositionOfTheCameraAndPDoesNot) {
  const auto m = measure_run(folder_.path(), with_body_truth(), body_from_camera_);
  ASSERT_TRUE(m.ok());
  EXPECT_EQ(m->truth_problem, "");
  ASSERT_TRUE(m->ate_p_m && m->ate_t_m && m->ate_t_live_m);
  EXPECT_LT(*m->ate_t_m, 1e-6);
  EXPECT_LT(*m->ate_t_live_m, 1e-6);
  EXPECT_GT(*m->ate_p_m, 0.01);
  EXPECT_LT(*m->ate_p_m, 0.1);
}

TEST_F(MeasureRun, ReadsTheSummary) {
  const auto m = measure_run(folder_.path(), with_body_truth(), body_from_camera_);
  ASSERT_TRUE(m.ok());
  EXPECT_EQ(m->frames, 110);
  EXPECT_EQ(m->frames_with_pose, 100);
  EXPECT_EQ(m->loops, 1);
  EXPECT_EQ(m->submaps, 2);
  EXPECT_EQ(m->frame_ms_median, 3.5);
  EXPECT_EQ(m->frame_ms_p95, 7.0);
  EXPECT_EQ(m->peak_mb, 80.0);
}

TEST_F(MeasureRun, ACorrectedTruthIsUsedByProtocolTOnly) {
  Sequence sequence = with_body_truth();
  Trajectory stretched = body_;
  for (auto& pose : stretched) {
    pose.T_world_frame = geometry::scaled(pose.T_world_frame, 1.5);
  }
  support::write_text(folder_.path() / "corrected.tum", evaluation::tum_text(stretched, ""));
  const auto before = measure_run(folder_.path(), sequence, body_from_camera_);
  sequence.corrected = Truth{folder_.path() / "corrected.tum"};
  const auto after = measure_run(folder_.path(), sequence, body_from_camera_);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(after->ate_p_m, before->ate_p_m);
  EXPECT_GT(after->ate_t_m.value_or(0.0), 0.1);
}

TEST_F(MeasureRun, CameraTruthIsComparedDirectlyAndOnlyByProtocolT) {
  Sequence sequence = with_body_truth();
  sequence.released = Truth{folder_.path() / "trajectory.tum", TruthFrame::kCamera0};
  const auto m = measure_run(folder_.path(), sequence, body_from_camera_);
  ASSERT_TRUE(m.ok());
  EXPECT_FALSE(m->ate_p_m);
  EXPECT_LT(m->ate_t_m.value_or(1.0), 1e-6);
}

TEST_F(MeasureRun, ACalibrationWithoutABodyIsRemarked) {
  std::string summary = support::read_text(folder_.path() / "summary.json");
  summary.replace(summary.find("[{}, {}]"), 8, "[{}]");
  support::write_text(folder_.path() / "summary.json", summary);
  const auto remark = [&](const Sequence& sequence, const geometry::SE3& pose) {
    return benchmark_report({{sequence, {measure_run(folder_.path(), sequence, pose).value()}}}, {})
        .tables[0]
        .rows[0]
        .back();
  };
  EXPECT_EQ(
      remark(with_body_truth(), {}),
      "the calibration gives camera 0 no pose on the body other than the identity: the body is taken to be camera 0");
  EXPECT_EQ(remark(with_body_truth(), body_from_camera_), "");
  Sequence of_camera = with_body_truth();
  of_camera.released = Truth{folder_.path() / "trajectory.tum", TruthFrame::kCamera0};
  EXPECT_EQ(remark(of_camera, {}), "");
}

TEST_F(MeasureRun, AContradictedCalibrationIsRemarked) {
  const auto remark = [&](const std::string& verdict) {
    support::write_text(folder_.path() / "summary.json",
                        R"({"frames": {"input": 110, "tracked": 100}, "calibration": )" + verdict + "}");
    const auto run = measure_run(folder_.path(), with_body_truth(), body_from_camera_);
    return benchmark_report({{with_body_truth(), {run.value()}}}, {}).tables[0].rows[0].back();
  };
  EXPECT_EQ(remark(R"({"verdict": "inconsistent"})"),
            "the images contradict the calibration in 1 of 1 runs; see their log.txt");
  for (const char* other : {R"({"verdict": "consistent"})", R"({"verdict": null})", "{}", "3"})
    EXPECT_EQ(remark(other), "") << other;
}

TEST_F(MeasureRun, AnUnreadableTruthIsReportedBesideTheCoverage) {
  support::write_text(folder_.path() / "truth.csv", "no trajectory");
  const auto m = measure_run(folder_.path(), with_body_truth(), body_from_camera_);
  ASSERT_TRUE(m.ok());
  EXPECT_NE(m->truth_problem, "");
  EXPECT_FALSE(m->ate_p_m || m->ate_t_m);
  EXPECT_EQ(m->frames_with_pose, 100);
}

TEST_F(MeasureRun, AMissingSummaryIsAnError) {
  EXPECT_FALSE(measure_run(folder_.path() / "missing", with_body_truth(), body_from_camera_).ok());
}

}  // namespace
}  // namespace bslam::benchmark
