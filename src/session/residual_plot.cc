#include "session/residual_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace bslam::session {
namespace {

using namespace report;  // figures
using calibration::ImageResiduals;

constexpr std::size_t kMinObservations = 10;  // minimum number of observations in a cell that is drawn
constexpr std::size_t kPanelsPerRow = 3;

// The scale of all arrows.
struct ArrowScale {
  double bar_px = 0;     // residual shown by the scale bar
  double bar_cells = 0;  // length of the scale bar, in widths of a cell
  double cells_per_px() const { return bar_cells / bar_px; }
};

// Returns the largest of 1, 2 and 5 times a power of ten that is not larger than `value`.
double rounded_down(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= value) return step * power;
  }
  return power;
}

// Scales arrows so that nearly all are at most as long as a cell is wide. Returns nullopt if there is none.
std::optional<ArrowScale> arrow_scale(const RunRecord& record) {
  std::vector<double> lengths_px;
  for (const CameraRecord& camera : record.cameras) {
    for (const calibration::ResidualCell& cell : camera.residuals.cells) {
      if (cell.observations >= kMinObservations) lengths_px.push_back(cell.mean_px.norm());
    }
  }
  if (lengths_px.empty()) return std::nullopt;
  const auto nearly_all =
      lengths_px.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(lengths_px.size() - 1));
  std::ranges::nth_element(lengths_px, nearly_all);
  const double largest_px = std::max(*nearly_all, 0.01);
  const double bar_px = rounded_down(largest_px);
  return ArrowScale{bar_px, bar_px / largest_px};
}

Series line(std::vector<std::array<double, 2>> points, std::string_view colour, double width_px) {
  Series series;
  series.points = std::move(points);
  series.colour = colour;
  series.width_px = width_px;
  return series;
}

// Pixels with v upward, as the axis of a figure, so that the panel shows the image upright.
std::array<double, 2> at(double u, double v) { return {u, -v}; }

Panel residual_panel(const CameraRecord& camera, const ArrowScale& scale) {
  const ImageResiduals& r = camera.residuals;
  const double w = r.width, h = r.height, cell_w = w / ImageResiduals::kColumns, cell_h = h / ImageResiduals::kRows;
  Panel panel{.title = fmt::format("{}: residuals, rms {:.2f} px", camera.name, r.rms_px),
              .x_label = "u [px]",
              .y_label = "v [px]"};
  panel.scale = AxisScale::kEqual;
  for (const double v : {0.0, std::round(h / 2), h}) panel.y_ticks.push_back({-v, fmt::format("{:.0f}", v)});
  panel.series.push_back(line({at(0, 0), at(w, 0), at(w, h), at(0, h), at(0, 0)}, kGrey, 1.0));
  Series arrows = line({}, kVermilion, 1.6), feet = line({}, kBlack, 2.5);
  feet.style = SeriesStyle::kPoints;
  for (std::size_t i = 0; i < r.cells.size(); ++i) {
    if (r.cells[i].observations < kMinObservations) continue;
    const double u = (static_cast<double>(i % ImageResiduals::kColumns) + 0.5) * cell_w;
    const double v = (static_cast<double>(i / ImageResiduals::kColumns) + 0.5) * cell_h;
    const Eigen::Vector2d tip = Eigen::Vector2d(u, v) + scale.cells_per_px() * cell_w * r.cells[i].mean_px;
    feet.points.push_back(at(u, v));
    arrows.points.insert(arrows.points.end(), {at(u, v), at(tip.x(), tip.y()), {kGap, kGap}});
  }
  Series bar = line({at(0, 1.06 * h), at(scale.bar_cells * cell_w, 1.06 * h)}, kBlack, 3.0);
  bar.label = fmt::format("{:g} px", scale.bar_px);
  panel.series.insert(panel.series.end(), {std::move(arrows), std::move(feet), std::move(bar)});
  return panel;
}

}  // namespace

std::vector<PanelRow> residual_rows(const RunRecord& record) {
  std::vector<PanelRow> rows;
  const auto scale = arrow_scale(record);
  if (!scale) return rows;
  std::vector<Panel> panels;
  for (const CameraRecord& camera : record.cameras) {
    if (camera.residuals.observations > 0) panels.push_back(residual_panel(camera, *scale));
  }
  const std::size_t num_rows = (panels.size() + kPanelsPerRow - 1) / kPanelsPerRow;
  rows.resize(num_rows, {.height_px = 300.0});
  for (std::size_t i = 0; i < panels.size(); ++i)  // rows of the same length, except that the last may be shorter
    rows[i / ((panels.size() + num_rows - 1) / num_rows)].panels.push_back(std::move(panels[i]));
  return rows;
}

}  // namespace bslam::session
