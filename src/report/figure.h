// Plots as SVG text, without dependencies: panels in rows, with axes, ticks, lines and legends on a light ground.
// Colours are those of Okabe and Ito, told apart by the colour-blind as well.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace bslam::report {

inline constexpr std::string_view kBlue = "#0072B2", kVermilion = "#D55E00", kGreen = "#009E73", kPurple = "#CC79A7",
                                  kSky = "#56B4E9", kOrange = "#E69F00", kBlack = "#222222", kGrey = "#777777";

// Colour of the k-th of several like things (cameras, stages); repeats after eight.
std::string_view series_colour(std::size_t k);

enum class SeriesStyle { kLine, kDashed, kPoints };

// Points in data units. A point that is not finite ends one piece of the line; the next begins a new one.
struct Series {
  std::string label;  // in the legend; empty: not there
  std::vector<std::array<double, 2>> points;
  std::string colour{kBlue};
  SeriesStyle style = SeriesStyle::kLine;
  double width_px = 1.6;  // of the line, or diameter of the points
};

// A shaded stretch of the x axis.
struct Band {
  double from = 0.0, to = 0.0;
  std::string colour{kVermilion};
};

// A vertical line at x.
struct Mark {
  double x = 0.0;
  std::string colour{kGrey};
};

// A line of the legend for bands or marks, which have no label of their own.
struct LegendEntry {
  std::string label;
  std::string colour;
};

enum class AxisScale { kFree, kEqual };     // equal: one unit is as long on x as on y (maps)
enum class AxisFloor { kFromData, kZero };  // where the y axis begins

struct Panel {
  std::string title{}, x_label{}, y_label{};
  std::vector<Series> series{};  // drawn in this order
  std::vector<Band> bands{};     // below them
  std::vector<Mark> marks{};
  std::vector<LegendEntry> extra_legend{};
  AxisScale scale = AxisScale::kFree;
  AxisFloor floor = AxisFloor::kFromData;
  double share = 1.0;  // of its row's width, against the row's other panels
};

struct PanelRow {
  double height_px = 260.0;
  std::vector<Panel> panels{};
};

struct Figure {
  std::string title{}, subtitle{};
  double width_px = 1000.0;
  std::vector<PanelRow> rows{};
};

// The whole figure as an SVG document. Same input, same bytes.
std::string figure_svg(const Figure& figure);

// Round numbers within [low, high], about `count` of them, 1, 2 or 5 times a power of ten apart. Empty where the range
// is empty or not finite.
std::vector<double> axis_ticks(double low, double high, int count);

// A long series as one point for each of `bins` equal stretches of x: the median of its points there, or their maximum.
// A series of no more than `bins` points stays as it is; stretches without points break the line.
enum class Reduction { kMedian, kMaximum };
std::vector<std::array<double, 2>> reduced(const std::vector<std::array<double, 2>>& points, std::size_t bins,
                                           Reduction reduction);

}  // namespace bslam::report
