#include "report/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/median.h"
#include "report/markup.h"

namespace bslam::report {

namespace {

constexpr double kTitleFont = 20.0, kSubtitleFont = 13.0, kPanelFont = 14.0, kFont = 12.0;
constexpr double kGlyphWidth =
    0.57;  // relative to the font size: an upper estimate of the mean width for sans-serif fonts
constexpr double kMarginLeft = 76.0, kMarginRight = 16.0, kMarginTop = 46.0, kMarginBottom = 44.0;
constexpr double kPagePadding = 14.0, kTickEveryX = 70.0, kTickEveryY = 32.0;  // pixels
constexpr double kSmallestStep =
    0.4;  // pixels: shorter line segments are omitted, since they are invisible and enlarge the file
constexpr std::array<std::string_view, 8> kPalette = {kBlue,   kVermilion, kGreen,    kPurple,
                                                      kOrange, kSky,       "#8C510A", kBlack};

struct Box {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
};

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool empty() const { return !(low <= high); }
  double size() const { return high - low; }
  void widen(double by) {
    low -= by;
    high += by;
  }
};

bool finite(const std::array<double, 2>& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); }

enum class Anchor { kStart, kMiddle, kEnd };

void add_text(std::string& out, double x, double y, std::string_view text, double size, Anchor anchor,
              std::string_view more = {}) {
  constexpr std::array<std::string_view, 3> kAnchors = {"start", "middle", "end"};
  fmt::format_to(std::back_inserter(out),
                 "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"{}{}>{}</text>\n", x,
                 y, size, kAnchors[static_cast<std::size_t>(anchor)], kBlack, more.empty() ? "" : " ", more,
                 escaped(text));
}

void add_line(std::string& out, double x0, double y0, double x1, double y1, std::string_view colour, double width) {
  fmt::format_to(std::back_inserter(out),
                 "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{}\"/>\n",
                 x0, y0, x1, y1, colour, width);
}

// Data ranges of a panel and its position on the page.
struct Axes {
  Extent x, y;
  Box box;

  double px(double value) const { return box.x + (value - x.low) / x.size() * box.width; }
  double py(double value) const { return box.y + box.height - (value - y.low) / y.size() * box.height; }
};

void make_equal(Axes& axes) {
  const double per_px = std::max(axes.x.size() / axes.box.width, axes.y.size() / axes.box.height);
  axes.x.widen(0.5 * (per_px * axes.box.width - axes.x.size()));
  axes.y.widen(0.5 * (per_px * axes.box.height - axes.y.size()));
}

Axes axes_of(const Panel& panel, const Box& box) {
  Axes axes{.x = {}, .y = {}, .box = box};
  for (const Series& series : panel.series) {
    for (const auto& point : series.points) {
      if (!finite(point)) continue;
      axes.x.add(point[0]);
      axes.y.add(point[1]);
    }
  }
  for (const Band& band : panel.bands) {
    axes.x.add(band.from);
    axes.x.add(band.to);
  }
  for (Extent* extent : {&axes.x, &axes.y}) {
    if (extent->empty()) *extent = {0.0, 1.0};
  }
  if (panel.floor == AxisFloor::kZero) axes.y.add(0.0);
  for (Extent* extent : {&axes.x, &axes.y}) {
    if (extent->size() <= 1e-9 * std::max(1.0, std::abs(extent->high))) extent->widen(0.5);
  }
  if (panel.scale == AxisScale::kEqual) {
    axes.x.widen(0.04 * axes.x.size());
    axes.y.widen(0.04 * axes.y.size());
    make_equal(axes);
  } else {
    const double room = 0.06 * axes.y.size();
    axes.y.high += room;
    if (panel.floor == AxisFloor::kFromData) axes.y.low -= room;
  }
  return axes;
}

std::string tick_text(double value, double step) {
  const double magnitude = std::max(std::abs(value), step);
  if (magnitude >= 1e6 || step < 1e-5) return fmt::format("{:g}", std::abs(value) < 1e-9 * step ? 0.0 : value);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.find_first_not_of("-0.") == std::string::npos ? "0" : text;
}

// Returns the text, shortened at its end if it is wider than `width` pixels.
std::string fitting(const std::string& text, double width) {
  const auto max_size = static_cast<std::size_t>(std::max(3.0, width / (kGlyphWidth * kFont)));
  return text.size() <= max_size ? text : text.substr(0, max_size - 2) + "..";
}

double step_of(const std::vector<double>& ticks) { return ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0; }

void add_axes(std::string& out, const Axes& axes, const Panel& panel) {
  const Box& b = axes.box;
  constexpr std::string_view kGrid = "#E3E3E3";
  const auto x_ticks = axis_ticks(axes.x.low, axes.x.high, std::max(2, static_cast<int>(b.width / kTickEveryX)));
  auto y_ticks = axis_ticks(axes.y.low, axes.y.high, std::max(2, static_cast<int>(b.height / kTickEveryY)));
  if (!panel.y_ticks.empty()) y_ticks.clear();
  for (const double t : x_ticks) {
    add_line(out, axes.px(t), b.y, axes.px(t), b.y + b.height, kGrid, 1);
    add_text(out, axes.px(t), b.y + b.height + 16, tick_text(t, step_of(x_ticks)), kFont, Anchor::kMiddle);
  }
  for (const double t : y_ticks) {
    add_line(out, b.x, axes.py(t), b.x + b.width, axes.py(t), kGrid, 1);
    add_text(out, b.x - 6, axes.py(t) + 4, tick_text(t, step_of(y_ticks)), kFont, Anchor::kEnd);
  }
  for (const NamedTick& tick : panel.y_ticks) {
    add_line(out, b.x, axes.py(tick.y), b.x + b.width, axes.py(tick.y), kGrid, 1);
    add_text(out, b.x - 6, axes.py(tick.y) + 4, fitting(tick.name, kMarginLeft - 8), kFont, Anchor::kEnd);
  }
  add_text(out, b.x + 0.5 * b.width, b.y + b.height + 34, panel.x_label, kFont, Anchor::kMiddle);
  const double x = b.x - kMarginLeft + 14, y = b.y + 0.5 * b.height;
  add_text(out, x, y, panel.y_label, kFont, Anchor::kMiddle,
           fmt::format("transform=\"rotate(-90 {:.1f} {:.1f})\"", x, y));
}

void add_series(std::string& out, const Axes& axes, const Series& series) {
  if (series.style == SeriesStyle::kPoints) {
    for (const auto& p : series.points) {
      if (!finite(p)) continue;
      fmt::format_to(std::back_inserter(out), "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"/>\n",
                     axes.px(p[0]), axes.py(p[1]), 0.5 * series.width_px, series.colour);
    }
    return;
  }
  std::string path;
  bool pen_down = false;
  std::array<double, 2> last{};  // last point that was drawn, in pixels
  for (const auto& p : series.points) {
    if (!finite(p)) {
      pen_down = false;
      continue;
    }
    const std::array<double, 2> now = {axes.px(p[0]), axes.py(p[1])};
    if (pen_down && std::hypot(now[0] - last[0], now[1] - last[1]) < kSmallestStep) continue;
    last = now;
    fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}{}", pen_down ? "L" : "M", now[0], now[1],
                   pen_down ? "" : "h0");  // a segment of zero length, so that an isolated point is drawn as a dot
    pen_down = true;
  }
  if (path.empty()) return;
  fmt::format_to(std::back_inserter(out),
                 "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" "
                 "stroke-linecap=\"round\"{}/>\n",
                 path, series.colour, series.width_px,
                 series.style == SeriesStyle::kDashed ? " stroke-dasharray=\"6 4\"" : "");
}

// Entries from left to right between the title and the plot area; entries that do not fit are omitted.
void add_legend(std::string& out, const Panel& panel, const Box& box) {
  double x = box.x;
  const double y = box.y - 10;
  const auto entry = [&](std::string_view label, std::string_view colour, std::string_view swatch) {
    const double width = 30 + kGlyphWidth * kFont * static_cast<double>(label.size());
    if (label.empty() || x + width > box.x + box.width + kMarginRight) return;
    out += fmt::format(fmt::runtime(swatch), fmt::arg("x", x), fmt::arg("y", y - 4), fmt::arg("colour", colour));
    add_text(out, x + 22, y, label, kFont, Anchor::kStart);
    x += width + 8;
  };
  for (const Series& series : panel.series) {
    switch (series.style) {
      case SeriesStyle::kPoints:
        entry(series.label, series.colour,
              "<circle cx=\"{x:.1f}\" cy=\"{y:.1f}\" r=\"3\" fill=\"{colour}\" "
              "transform=\"translate(10 0)\"/>\n");
        break;
      case SeriesStyle::kDashed:
        entry(series.label, series.colour,
              "<path d=\"M{x:.1f} {y:.1f}h18\" stroke=\"{colour}\" stroke-width=\"2\" "
              "stroke-dasharray=\"5 3\"/>\n");
        break;
      case SeriesStyle::kLine:
        entry(series.label, series.colour,
              "<path d=\"M{x:.1f} {y:.1f}h18\" stroke=\"{colour}\" stroke-width=\"2.5\"/>\n");
        break;
    }
  }
  for (const LegendEntry& extra : panel.extra_legend) {
    entry(extra.label, extra.colour,
          "<rect x=\"{x:.1f}\" y=\"{y:.1f}\" width=\"18\" height=\"10\" fill=\"{colour}\" "
          "fill-opacity=\"0.45\" transform=\"translate(0 -5)\"/>\n");
  }
}

void add_panel(std::string& out, const Panel& panel, const Box& outer, int clip_id) {
  const Box box = {outer.x + kMarginLeft, outer.y + kMarginTop,
                   std::max(20.0, outer.width - kMarginLeft - kMarginRight),
                   std::max(20.0, outer.height - kMarginTop - kMarginBottom)};
  const Axes axes = axes_of(panel, box);
  add_text(out, box.x, outer.y + 16, panel.title, kPanelFont, Anchor::kStart, "font-weight=\"600\"");
  fmt::format_to(
      std::back_inserter(out),
      "<clipPath id=\"c{}\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/></clipPath>\n", clip_id,
      box.x, box.y, box.width, box.height);
  add_axes(out, axes, panel);
  out += fmt::format("<g clip-path=\"url(#c{})\">\n", clip_id);
  for (const Band& band : panel.bands) {
    const double from = axes.px(band.from), width = std::max(1.0, axes.px(band.to) - from);
    fmt::format_to(
        std::back_inserter(out),
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" fill-opacity=\"0.18\"/>\n",
        from, box.y, width, box.height, band.colour);
  }
  for (const Mark& mark : panel.marks) {
    add_line(out, axes.px(mark.x), box.y, axes.px(mark.x), box.y + box.height, mark.colour, 1.2);
  }
  for (const Series& series : panel.series) add_series(out, axes, series);
  out += "</g>\n";
  fmt::format_to(
      std::back_inserter(out),
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#999999\"/>\n", box.x,
      box.y, box.width, box.height);
  add_legend(out, panel, box);
}

double value_of(const std::vector<double>& values, Reduction reduction) {
  if (reduction == Reduction::kMaximum) return *std::ranges::max_element(values);
  return median(values);
}

}  // namespace

std::string_view series_colour(std::size_t k) { return kPalette[k % kPalette.size()]; }

std::vector<double> axis_ticks(double low, double high, int count) {
  const double size = high - low;
  if (!std::isfinite(size) || !(size > 0.0) || count < 1) return {};
  const double raw = size / count, power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  if (!(std::abs(first) < 1e15) || !(last - first < 1000.0)) return {};  // a range too narrow to represent the ticks
  for (double k = first; k <= last; k += 1.0) ticks.push_back(k * step);
  return ticks;
}

std::vector<std::array<double, 2>> reduced(const std::vector<std::array<double, 2>>& points, std::size_t bins,
                                           Reduction reduction) {
  if (points.size() <= bins || bins == 0) return points;
  Extent x;
  for (const auto& p : points) {
    if (finite(p)) x.add(p[0]);
  }
  if (x.empty() || !(x.size() > 0.0)) return points;
  const double width = x.size() / static_cast<double>(bins);
  std::vector<std::vector<double>> values(bins);
  for (const auto& p : points) {
    if (!finite(p)) continue;
    values[std::min(bins - 1, static_cast<std::size_t>((p[0] - x.low) / width))].push_back(p[1]);
  }
  std::vector<std::array<double, 2>> result;
  for (std::size_t k = 0; k < bins; ++k) {
    const double centre = x.low + (static_cast<double>(k) + 0.5) * width;
    result.push_back(
        {centre, values[k].empty() ? std::numeric_limits<double>::quiet_NaN() : value_of(values[k], reduction)});
  }
  return result;
}

std::string figure_svg(const Figure& figure) {
  const double head = 36.0 + (figure.subtitle.empty() ? 0.0 : 22.0);
  double height = head + kPagePadding;
  for (const PanelRow& row : figure.rows) height += row.height_px;
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>\n",
      figure.width_px, height);
  add_text(out, kPagePadding, 28, figure.title, kTitleFont, Anchor::kStart, "font-weight=\"600\"");
  if (!figure.subtitle.empty()) add_text(out, kPagePadding, 48, figure.subtitle, kSubtitleFont, Anchor::kStart);
  double y = head;
  int clip_id = 0;
  for (const PanelRow& row : figure.rows) {
    double total_width = 0.0;
    for (const Panel& panel : row.panels) total_width += panel.width_fraction;
    double x = 0.0;
    for (const Panel& panel : row.panels) {
      const double width = figure.width_px * panel.width_fraction / total_width;
      add_panel(out, panel, {x, y, width, row.height_px}, clip_id++);
      x += width;
    }
    y += row.height_px;
  }
  out += "</svg>\n";
  return out;
}

}  // namespace bslam::report
