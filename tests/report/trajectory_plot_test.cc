#include "report/trajectory_plot.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

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

TEST(TrajectoryPlot, UsesYAsVerticalWithCameraAxes) {
  TrajectoryPlotInput input;
  input.estimate = circle(true);
  const std::string svg = trajectory_plot_svg(input);
  EXPECT_TRUE(contains(svg, "Top view (along y)"));
  EXPECT_FALSE(contains(svg, "ground truth"));
  EXPECT_FALSE(contains(svg, "Position error"));
}

// The vertical positions on the page of the points named start and end in the side view.
std::array<double, 2> ends_of_side_view(const std::string& svg) {
  const std::size_t side = svg.find("Side view");
  const auto y_after = [&](std::size_t at) { return std::stod(svg.substr(svg.find("cy=\"", at) + 4)); };
  const std::size_t start = svg.find("<circle", side);
  return {y_after(start), y_after(svg.find("<circle", start + 1))};
}

TEST(TrajectoryPlot, DrawsAClimbUpwards) {
  TrajectoryPlotInput camera;
  camera.axes = WorldAxes::kCamera;
  TrajectoryPlotInput body;
  for (int i = 0; i <= 20; ++i) {  // 4 m forward and 1 m up
    const double s = 0.05 * i;
    camera.estimate.push_back({from_seconds(s), {geometry::Quaterniond::Identity(), {0, -s, 4 * s}}});
    body.estimate.push_back({from_seconds(s), {geometry::Quaterniond::Identity(), {4 * s, 2 * s, s}}});
  }
  for (const TrajectoryPlotInput& input : {camera, body}) {
    const auto [start, end] = ends_of_side_view(trajectory_plot_svg(input));
    EXPECT_LT(end, start);  // pixels are counted from the top of the page
  }
  EXPECT_TRUE(contains(trajectory_plot_svg(camera), ">-y [m]<"));
}

TEST(TrajectoryPlot, ShowsSmallErrorsInMillimetres) {
  const evaluation::Trajectory truth = circle(false);
  evaluation::Trajectory estimate = truth;
  for (std::size_t i = 0; i < estimate.size(); i += 2) {
    estimate[i].T_world_frame = {geometry::Quaterniond::Identity(),
                                 estimate[i].T_world_frame.translation() + geometry::Vector3d(0, 0, 0.001)};
  }
  const auto evaluation = evaluation::evaluate(estimate, truth, {});
  ASSERT_TRUE(evaluation.ok());
  const std::string svg = trajectory_plot_svg(evaluation_plot_input(*evaluation, truth, "errors"));
  EXPECT_TRUE(contains(svg, "error [mm]"));
  EXPECT_TRUE(contains(svg, "ATE rmse 0.5 mm"));
  EXPECT_FALSE(contains(svg, "error [m]"));
}

TEST(TrajectoryPlot, DrawsAnEmptyTrajectory) { EXPECT_EQ(xml_fault(trajectory_plot_svg({})), ""); }

TEST(TrajectoryPlot, DrawsLandmarksExceptForThoseFarOutside) {
  TrajectoryPlotInput input;
  input.estimate = circle(true);
  const auto circles = [](const std::string& svg) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = svg.find("<circle", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  const std::size_t without = circles(trajectory_plot_svg(input));
  for (int i = 0; i < 200; ++i) input.landmarks.push_back({0.01 * i, 0.005 * (i % 50), 0.02 * i});
  input.landmarks.push_back({9e6, 9e6, 9e6});
  const std::string svg = trajectory_plot_svg(input);
  EXPECT_TRUE(contains(svg, "landmarks"));
  EXPECT_GE(circles(svg), without + 2 * 150);
  EXPECT_FALSE(contains(svg, "e+0"));
  EXPECT_EQ(xml_fault(svg), "");
}

}  // namespace
}  // namespace bslam::report
