#include "report/figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "report/well_formed_xml.h"

namespace bslam::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::size_t occurrences(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

Figure with(Panel panel) {
  Figure figure{.title = "title"};
  figure.rows.push_back({.height_px = 200, .panels = {std::move(panel)}});
  return figure;
}

Series line(std::vector<std::array<double, 2>> points) {
  Series series;
  series.label = "a line";
  series.points = std::move(points);
  return series;
}

TEST(XmlFault, ReportsErrors) {
  EXPECT_EQ(xml_fault("<a><b x=\"1\"/>t &amp; u</a>"), "");
  for (const char* text : {"", "<a>", "<a></b>", "<a/><b/>", "<a>&x</a>", "<a x=\"></a>", "<a", "<a>></a>"}) {
    EXPECT_NE(xml_fault(text), "") << text;
  }
}

TEST(AxisTicks, AreRoundAndInside) {
  EXPECT_EQ(axis_ticks(0.0, 10.0, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(axis_ticks(-1.2, 1.2, 4), (std::vector<double>{-1, 0, 1}));
  for (const double size : {1e-9, 3e-3, 0.7, 12.0, 9.9e5, 4e12}) {
    const auto ticks = axis_ticks(5.0 * size, 6.0 * size, 6);
    ASSERT_GE(ticks.size(), 3u);
    ASSERT_LE(ticks.size(), 8u);
    for (const double t : ticks) {
      EXPECT_GE(t, 5.0 * size * (1 - 1e-9));
      EXPECT_LE(t, 6.0 * size * (1 + 1e-9));
    }
  }
}

TEST(AxisTicks, AreEmptyForAnEmptyRange) {
  EXPECT_TRUE(axis_ticks(1.0, 1.0, 5).empty());
  EXPECT_TRUE(axis_ticks(2.0, 1.0, 5).empty());
  EXPECT_TRUE(axis_ticks(0.0, kNan, 5).empty());
  EXPECT_TRUE(axis_ticks(0.0, std::numeric_limits<double>::infinity(), 5).empty());
  EXPECT_TRUE(axis_ticks(1e18, 1e18 + 256, 5).empty());  // steps lost in the digits
}

TEST(Figure, IsWellFormedForAnyText) {
  Panel panel{.title = "a < b & \"c\" > d", .x_label = "x\x01", .y_label = "\xFFy"};
  panel.series.push_back(line({{0, 0}, {1, 2}}));
  panel.series[0].label = "<&>";
  const std::string svg = figure_svg(with(panel));
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_NE(svg.find("a &lt; b &amp; &quot;c&quot; &gt; d"), std::string::npos);
  EXPECT_NE(svg.find(">?y<"), std::string::npos);
  panel.title = "Umlaut \xC3\xA4";
  EXPECT_NE(figure_svg(with(panel)).find("Umlaut \xC3\xA4"), std::string::npos);
}

TEST(Figure, BreaksLinesAtPointsThatAreNotFinite) {
  Panel panel{.title = "gap"};
  panel.series.push_back(line({{0, 0}, {1, 1}, {kNan, kNan}, {2, 1}, {3, 0}}));
  const std::string svg = figure_svg(with(panel));
  const std::size_t path = svg.find("<path d=\"M");
  ASSERT_NE(path, std::string::npos);
  const std::string data = svg.substr(path, svg.find('/', path) - path);
  EXPECT_EQ(occurrences(data, "M"), 2u);
  EXPECT_EQ(occurrences(data, "L"), 2u);
}

TEST(Figure, HasEqualScalesOnEqualAxes) {
  // Corners of a 10 x 1 m path, drawn as points: their distances in pixels keep the ratio.
  Panel panel{.title = "map", .scale = AxisScale::kEqual};
  Series corners = line({{0, 0}, {10, 0}, {10, 1}});
  corners.label = "";
  corners.style = SeriesStyle::kPoints;
  panel.series.push_back(corners);
  const std::string svg = figure_svg(with(panel));
  std::vector<std::array<double, 2>> pixels;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1)) {
    std::array<double, 2> p{};
    ASSERT_EQ(std::sscanf(svg.c_str() + at, "<circle cx=\"%lf\" cy=\"%lf\"", &p[0], &p[1]), 2);
    pixels.push_back(p);
  }
  ASSERT_EQ(pixels.size(), 3u);
  EXPECT_NEAR(pixels[1][0] - pixels[0][0], 10.0 * (pixels[1][1] - pixels[2][1]), 1.1);  // written to 0.1 px
}

TEST(Figure, HandlesEmptyConstantAndInfiniteData) {
  for (const auto& points :
       std::vector<std::vector<std::array<double, 2>>>{{},
                                                       {{1, 1}},
                                                       {{5, 3}, {5, 3}},
                                                       {{kNan, 1}},
                                                       {{0, std::numeric_limits<double>::infinity()}, {1, 1}},
                                                       {{1e15, -1e15}}}) {
    for (const AxisScale scale : {AxisScale::kFree, AxisScale::kEqual}) {
      Panel panel{.title = "odd", .scale = scale};
      panel.series.push_back(line(points));
      const std::string svg = figure_svg(with(panel));
      EXPECT_EQ(xml_fault(svg), "");
      EXPECT_EQ(svg.find("nan"), std::string::npos);
      EXPECT_EQ(svg.find("\"inf"), std::string::npos);
    }
  }
}

TEST(Reduced, KeepsMediansMaximaAndGaps) {
  std::vector<std::array<double, 2>> points;
  for (int i = 0; i <= 100; ++i) {
    if (i >= 40 && i < 60) continue;
    points.push_back({static_cast<double>(i), i == 25 ? 1000.0 : 1.0});
  }
  const auto medians = reduced(points, 10, Reduction::kMedian), maxima = reduced(points, 10, Reduction::kMaximum);
  ASSERT_EQ(medians.size(), 10u);
  EXPECT_EQ(medians[2][1], 1.0);
  EXPECT_EQ(maxima[2][1], 1000.0);
  EXPECT_TRUE(std::isnan(medians[4][1]) && std::isnan(medians[5][1]));
  EXPECT_EQ(reduced(points, 81, Reduction::kMedian), points);
}

TEST(SeriesColours, DifferForEightSeries) {
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(series_colour(i), series_colour(j));
  }
}

}  // namespace
}  // namespace bslam::report
