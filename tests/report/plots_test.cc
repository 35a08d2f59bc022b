#include <gtest/gtest.h>

#include <cmath>

#include "report/run_plot.h"
#include "report/trajectory_plot.h"
#include "report/well_formed_xml.h"

namespace bslam::report {
namespace {

RunRecord short_run(int frames) {
  RunRecord record;
  record.data = "A <quad> & more";
  record.mode = "sequential";
  record.cameras = {{"front", frames, 0, {}}, {"rear", frames, 0, {}}};
  for (int i = 0; i < frames; ++i) {
    FrameRecord frame;
    frame.time_s = 0.05 * i;
    frame.keyframe = i % 5 == 0;
    frame.frame_ms = 20.0 + i % 3;
    frame.cameras = {{true, 1000 + i, 300, 250}, {i % 2 == 0, 900, 200, 100}};
    if (i >= 10 && i < 15) frame.outcome = FrameOutcome::kLost;
    add_stage_sample(record, "extract", StagePlace::kFrame, {frame.time_s, 9.0});
    if (frame.keyframe) add_stage_sample(record, "local adjustment", StagePlace::kBackground, {frame.time_s, 50.0});
    record.frames.push_back(frame);
  }
  record.loops = {{0.9, 0.1, 50}};
  return record;
}

evaluation::Trajectory circle(bool camera_world) {
  evaluation::Trajectory trajectory;
  for (int i = 0; i < 100; ++i) {
    const double a = 0.05 * i, h = 0.1 * std::sin(a);
    const geometry::Vector3d p(3 * std::cos(a), camera_world ? h : 3 * std::sin(a), camera_world ? 3 * std::sin(a) : h);
    trajectory.push_back({from_seconds(0.05 * i), {geometry::Quaterniond::Identity(), p}});
  }
  return trajectory;
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(RunPlot, NamesCamerasStagesAndEvents) {
  const std::string svg = run_plot_svg(short_run(40));
  EXPECT_EQ(xml_fault(svg), "");
  for (const char* word : {"front", "rear", "extract", "local adjustment", "keyframe", "loop closed", "lost",
                           "35 of 40 frames tracked", "A &lt;quad&gt; &amp; more"}) {
    EXPECT_TRUE(contains(svg, word)) << word;
  }
  EXPECT_FALSE(contains(svg, "nan"));
  EXPECT_FALSE(contains(svg, "relocalised"));
}

std::size_t count(const std::string& text, std::string_view part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(RunPlot, ShowsWhichCamerasWereNotSound) {
  constexpr std::string_view kBar = "stroke-width=\"6";
  const std::string sound = run_plot_svg(short_run(40));
  RunRecord record = short_run(40);
  record.cameras[1].states = {{"ok", "", 0.0, 0.5}, {"out", "frozen", 0.55, 1.0}, {"ok", "", 1.05, 1.95}};
  const std::string svg = run_plot_svg(record);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_TRUE(contains(svg, "Cameras that were not sound"));
  EXPECT_TRUE(contains(svg, "out: frozen"));
  EXPECT_GT(count(svg, kBar), count(sound, kBar));
  EXPECT_FALSE(contains(sound, "Cameras that were not sound"));
  record.cameras[1].states = {{"ok", "", 0.0, 1.95}};
  EXPECT_EQ(run_plot_svg(record), sound);
  record.frames.clear();
  record.cameras[1].states = {{"out", "frozen", 0.55, 1.0}};
  EXPECT_EQ(xml_fault(run_plot_svg(record)), "");
}

TEST(RunPlot, IsTheSameForTheSameRecord) { EXPECT_EQ(run_plot_svg(short_run(40)), run_plot_svg(short_run(40))); }

TEST(RunPlot, StaysSmallForALongRun) {
  RunRecord record = short_run(20000);
  for (int i = 0; i < 10000; ++i) {  // a camera that flickers
    record.cameras[1].states.push_back(
        {i % 2 == 0 ? "ok" : "out", i % 2 == 0 ? "" : "no-images", 0.1 * i, 0.1 * i + 0.05});
  }
  const std::string svg = run_plot_svg(record);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_LT(svg.size(), 1'000'000u);
  EXPECT_TRUE(contains(svg, "frame, largest"));
}

TEST(RunPlot, DrawsARunThatHasNothing) {
  EXPECT_EQ(xml_fault(run_plot_svg({})), "");
  EXPECT_EQ(xml_fault(run_plot_svg(short_run(1))), "");
}

TEST(TrajectoryPlot, ShowsViewsAndError) {
  const evaluation::Trajectory truth = circle(false);
  const auto evaluation = evaluation::evaluate(truth, truth, {});
  ASSERT_TRUE(evaluation.ok());
  const std::string svg = trajectory_plot_svg(evaluation_plot_input(*evaluation, truth, "est.tum against gt.tum"));
  EXPECT_EQ(xml_fault(svg), "");
  for (const char* word :
       {"est.tum against gt.tum", "Top view (along z)", "Side view", "ground truth", "rmse", "coverage 100.0 %"}) {
    EXPECT_TRUE(contains(svg, word)) << word;
  }
}

TEST(TrajectoryPlot, LooksAlongYInAWorldOfCameraAxes) {
  TrajectoryPlotInput input;
  input.estimate = circle(true);
  const std::string svg = trajectory_plot_svg(input);
  EXPECT_TRUE(contains(svg, "Top view (along y)"));
  EXPECT_FALSE(contains(svg, "ground truth"));
  EXPECT_FALSE(contains(svg, "Position error"));
}

TEST(TrajectoryPlot, DrawsATrajectoryThatIsEmpty) { EXPECT_EQ(xml_fault(trajectory_plot_svg({})), ""); }

}  // namespace
}  // namespace bslam::report
