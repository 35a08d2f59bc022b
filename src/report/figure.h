// Plots as SVG text, without dependencies: rows of panels with axes, ticks, lines and legends on a white background.
// The colours are from Okabe and Ito and can be distinguished by colour-blind readers as well.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace bslam::report {

inline constexpr std::string_view kBlue = "#0072B2", kVermilion = "#D55E00", kGreen = "#009E73", kPurple = "#CC79A7",
                                  kSky = "#56B4E9", kOrange = "#E69F00", kBlack = "#222222", kGrey = "#777777";

// Colour of the k-th camera or stage; repeats after eight.
std::string_view series_colour(std::size_t k);

enum class SeriesStyle { kLine, kDashed, kPoints };

inline constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

// Points in data units. A point that is not finite, such as kGap, interrupts the line.
struct Series {
  std::string label;  // shown in the legend unless empty
  std::vector<std::array<double, 2>> points;
  std::string colour{kBlue};
  SeriesStyle style = SeriesStyle::kLine;
  double width_px = 1.6;  // width of the line, or diameter of the points
};

// A shaded interval of the x axis.
struct Band {
  double from = 0.0, to = 0.0;
  std::string colour{kVermilion};
};

// A vertical line at x.
struct Mark {
  double x = 0.0;
  std::string colour{kGrey};
};

// A legend entry for bands or marks, which have no label.
struct LegendEntry {
  std::string label;
  std::string colour;
};

enum class AxisScale { kFree, kEqual };     // equal: x and y have the same scale, as in maps
enum class AxisFloor { kFromData, kZero };  // lower end of the y axis

// A tick of the y axis with a text instead of its value.
struct NamedTick {
  double y = 0.0;
  std::string name;
};

struct Panel {
  std::string title{}, x_label{}, y_label{};
  std::vector<Series> series{};  // drawn in this order
  std::vector<Band> bands{};     // below them
  std::vector<Mark> marks{};
  std::vector<LegendEntry> extra_legend{};
  std::vector<NamedTick> y_ticks{};  // replace the numbers of the y axis unless empty
  AxisScale scale = AxisScale::kFree;
  AxisFloor floor = AxisFloor::kFromData;
  double width_fraction = 1.0;  // width relative to the other panels of the row
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

// Returns the figure as an SVG document. The output is deterministic.
std::string figure_svg(const Figure& figure);

// Returns about `count` round numbers within [low, high], spaced by 1, 2 or 5 times a power of ten. The list is empty
// if the range is empty or not finite.
std::vector<double> axis_ticks(double low, double high, int count);

// Reduces a long series to one point for each of `bins` equal intervals of x: the median or the maximum of the points
// in the interval. A series of no more than `bins` points is returned unchanged. Intervals without points interrupt the
// line.
enum class Reduction { kMedian, kMaximum };
std::vector<std::array<double, 2>> reduced(const std::vector<std::array<double, 2>>& points, std::size_t bins,
                                           Reduction reduction);

}  // namespace bslam::report
