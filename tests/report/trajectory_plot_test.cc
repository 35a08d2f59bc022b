#include "report/trajectory_plot.h"

#include <gtest/gtest.h>

#include <cmath>

#include "report/well_formed_xml.h"

namespace bslam::report {
namespace {

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
