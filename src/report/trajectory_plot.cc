#include "report/trajectory_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "evaluation/association.h"
#include "report/figure.h"

namespace bslam::report {

namespace {

using evaluation::Trajectory;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr TimeNs kGapIntervals = 3;  // a gap is longer than this many median intervals between poses
constexpr std::array<const char*, 3> kAxisNames = {"x", "y", "z"};

// An axis of the world, in its own or in the opposite direction.
struct Axis {
  int index = 0;
  double sign = 1.0;
  double of(const Eigen::Vector3d& p) const { return sign * p[index]; }
  std::string name() const {
    return fmt::format("{}{}", sign < 0 ? "-" : "", kAxisNames[static_cast<std::size_t>(index)]);
  }
};

// The axes of the two views.
struct ViewAxes {
  Axis right{0}, forward{1}, up{2};
};

Eigen::Vector3d extent_of(const Trajectory& trajectory) {
  Eigen::AlignedBox3d box;
  for (const auto& pose : trajectory) box.extend(pose.T_world_frame.translation());
  return box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.sizes());
}

ViewAxes view_axes(WorldAxes world, const Eigen::Vector3d& extent) {
  const bool camera = world == WorldAxes::kCamera || extent.y() < 0.5 * extent.z();
  if (camera) return {.right = {0}, .forward = {2}, .up = {1, -1.0}};
  return {};
}

// Lengths below 0.1 m are given in millimetres.
struct LengthUnit {
  double per_metre = 1.0;
  const char* name = "m";
};

LengthUnit unit_for(double length_m) { return length_m < 0.1 ? LengthUnit{1000.0, "mm"} : LengthUnit{}; }

std::string length_text(double length_m) {
  const LengthUnit unit = unit_for(length_m);
  return fmt::format("{:.3g} {}", unit.per_metre * length_m, unit.name);
}

Series path_series(const Trajectory& trajectory, const Axis& horizontal, const Axis& vertical) {
  Series series;
  const TimeNs gap = kGapIntervals * evaluation::median_interval_ns(trajectory);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (i > 0 && trajectory[i].time_ns - trajectory[i - 1].time_ns > gap) series.points.push_back({kNone, kNone});
    const Eigen::Vector3d& p = trajectory[i].T_world_frame.translation();
    series.points.push_back({horizontal.of(p), vertical.of(p)});
  }
  return series;
}

// The landmarks that are drawn: at most a few thousand, without the outermost ones, which would shrink the path.
std::vector<Eigen::Vector3d> drawn_landmarks(const std::vector<Eigen::Vector3d>& landmarks) {
  constexpr double kOutside = 0.03;  // fraction that is omitted at either end of each axis
  constexpr std::size_t kMaxDrawn = 4000;
  if (landmarks.empty()) return {};
  Eigen::Vector3d low, high;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : landmarks) values.push_back(p[axis]);
    const auto rank = static_cast<std::ptrdiff_t>(kOutside * static_cast<double>(values.size()));
    std::ranges::sort(values);
    low[axis] = *(values.begin() + rank);
    high[axis] = *(values.end() - 1 - rank);
  }
  const Eigen::AlignedBox3d box(low, high);
  const std::size_t step = (landmarks.size() + kMaxDrawn - 1) / kMaxDrawn;
  std::vector<Eigen::Vector3d> out;
  for (std::size_t i = 0; i < landmarks.size(); i += step) {
    if (box.contains(landmarks[i])) out.push_back(landmarks[i]);
  }
  return out;
}

Panel view_panel(const TrajectoryPlotInput& input, std::string title, const Axis& horizontal, const Axis& vertical) {
  Panel panel{.title = std::move(title),
              .x_label = horizontal.name() + " [m]",
              .y_label = vertical.name() + " [m]",
              .scale = AxisScale::kEqual};
  if (!input.landmarks.empty()) {
    Series landmarks;
    landmarks.label = "landmarks";
    landmarks.colour = kGrey;
    landmarks.style = SeriesStyle::kPoints;
    landmarks.width_px = 1.6;
    for (const Eigen::Vector3d& p : input.landmarks) landmarks.points.push_back({horizontal.of(p), vertical.of(p)});
    panel.series.push_back(std::move(landmarks));
  }
  if (!input.ground_truth.empty()) {
    Series truth = path_series(input.ground_truth, horizontal, vertical);
    truth.label = "ground truth";
    truth.colour = kGrey;
    truth.width_px = 3.2;
    panel.series.push_back(std::move(truth));
  }
  Series estimate = path_series(input.estimate, horizontal, vertical);
  estimate.label = "estimate";
  const auto ends = std::array{estimate.points.empty() ? std::array{kNone, kNone} : estimate.points.front(),
                               estimate.points.empty() ? std::array{kNone, kNone} : estimate.points.back()};
  panel.series.push_back(std::move(estimate));
  const auto end_point = [&](const char* label, std::string_view colour, const std::array<double, 2>& point) {
    Series series;
    series.label = label;
    series.points = {point};
    series.colour = colour;
    series.style = SeriesStyle::kPoints;
    series.width_px = 9;
    panel.series.push_back(std::move(series));
  };
  end_point("start", kGreen, ends[0]);
  end_point("end", kVermilion, ends[1]);
  return panel;
}

Panel error_panel(const TrajectoryPlotInput& input) {
  double largest = 0.0;
  for (const auto& e : input.errors) largest = std::max(largest, e.position_m);
  const LengthUnit unit = unit_for(largest);
  Panel panel{.title = "Position error after alignment",
              .x_label = "time [s]",
              .y_label = fmt::format("error [{}]", unit.name)};
  panel.floor = AxisFloor::kZero;
  Series error;
  error.label = "error";
  error.width_px = 1.4;
  Trajectory times;  // the poses of the errors, for the median interval
  std::vector<double> values;
  for (const auto& e : input.errors) {
    times.push_back({e.time_ns, {}});
    values.push_back(e.position_m);
  }
  const TimeNs begin = input.errors.front().time_ns, gap = kGapIntervals * evaluation::median_interval_ns(times);
  for (std::size_t i = 0; i < input.errors.size(); ++i) {
    if (i > 0 && times[i].time_ns - times[i - 1].time_ns > gap) error.points.push_back({kNone, kNone});
    error.points.push_back({to_seconds(times[i].time_ns - begin), unit.per_metre * values[i]});
  }
  const double end_s = to_seconds(input.errors.back().time_ns - begin);
  const double rmse = evaluation::statistics_of(std::move(values)).rmse;
  Series mean;
  mean.label = "rmse " + length_text(rmse);
  mean.points = {{0.0, unit.per_metre * rmse}, {end_s, unit.per_metre * rmse}};
  mean.colour = kVermilion;
  mean.style = SeriesStyle::kDashed;
  panel.series = {std::move(error), std::move(mean)};
  return panel;
}

}  // namespace

TrajectoryPlotInput evaluation_plot_input(const evaluation::TrajectoryEvaluation& evaluation,
                                          const Trajectory& ground_truth, std::string title) {
  const auto& ate = evaluation.ate;
  return {.title = std::move(title),
          .subtitle = fmt::format("ATE rmse {}, median {}, max {} over {} poses; coverage {:.1f} %; path {:.1f} m",
                                  length_text(ate.rmse), length_text(ate.median), length_text(ate.max), ate.count,
                                  100.0 * evaluation.coverage, evaluation.gt_length_m),
          .estimate = evaluation.aligned_estimate,
          .ground_truth = ground_truth,
          .errors = evaluation.errors};
}

std::string trajectory_plot_svg(const TrajectoryPlotInput& given) {
  TrajectoryPlotInput input = given;
  input.landmarks = drawn_landmarks(given.landmarks);
  const Eigen::Vector3d extent = extent_of(input.ground_truth.empty() ? input.estimate : input.ground_truth);
  const ViewAxes axes = view_axes(input.axes, extent);
  const auto title = [&](const char* name, const Axis& along) {
    return fmt::format("{} (along {})", name, kAxisNames[static_cast<std::size_t>(along.index)]);
  };
  const bool wide = extent[axes.right.index] >= extent[axes.forward.index];  // the side view shows the longer direction
  Figure figure{.title = input.title, .subtitle = input.subtitle};
  PanelRow views{.height_px = 480.0};
  views.panels.push_back(view_panel(input, title("Top view", axes.up), axes.right, axes.forward));
  views.panels.push_back(view_panel(input, title("Side view", wide ? axes.forward : axes.right),
                                    wide ? axes.right : axes.forward, axes.up));
  figure.rows.push_back(std::move(views));
  if (!input.errors.empty()) figure.rows.push_back({.height_px = 250.0, .panels = {error_panel(input)}});
  return figure_svg(figure);
}

}  // namespace bslam::report
