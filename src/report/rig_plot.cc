#include "report/rig_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "report/figure.h"
#include "report/markup.h"

namespace bslam::report {
namespace {

using geometry::SE3;
using geometry::Vector2d;
using geometry::Vector3d;

constexpr double kWidth = 1000, kMargin = 28, kHeader = 64, kFooter = 44;
constexpr double kPanelWidth = (kWidth - 3 * kMargin) / 2, kMinPanelHeight = 180, kMaxPanelHeight = 460;
constexpr double kNameMargin = 150, kTopMargin = 60;  // pixels

// Bearings of pixels on lines from the principal point to the image border, up to the limit of the camera model.
std::vector<Vector3d> fan_bearings(const camera::Camera& camera) {
  constexpr int kSide = 16, kInwards = 24, kEvery = 4;
  const double right = camera.width - 1, bottom = camera.height - 1;
  const std::array<Vector2d, 5> corners = {Vector2d(0, 0), {right, 0}, {right, bottom}, {0, bottom}, {0, 0}};
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const Vector2d centre(k.cx, k.cy);
  std::vector<Vector3d> bearings;
  for (std::size_t side = 0; side < 4; ++side) {
    for (int s = 0; s < kSide; ++s) {
      const Vector2d pixel = corners[side] + (corners[side + 1] - corners[side]) * s / kSide;
      for (int step = kInwards; step > 0; --step) {
        const auto bearing = camera.unproject(centre + (pixel - centre) * step / kInwards);
        if (!bearing) continue;
        bearings.push_back(*bearing);
        step -= kEvery - 1;  // the outermost valid pixel, then every fourth step inwards
      }
    }
  }
  return bearings;
}

// Counter-clockwise convex hull (Andrew's monotone chain).
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  if (points.size() < 3) return points;
  std::vector<Vector2d> hull;
  const auto turns_right = [&](const Vector2d& p) {
    const Vector2d a = hull[hull.size() - 1] - hull[hull.size() - 2], b = p - hull[hull.size() - 1];
    return a.x() * b.y() - a.y() * b.x() <= 0;
  };
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= base + 2 && turns_right(p)) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

struct DrawnCamera {
  std::string name, colour;
  Vector3d position, axis_end;    // position of the camera, and end of the drawn optical axis
  std::vector<Vector3d> frustum;  // end points of viewing rays
};

// Projects a point to a view: metres to the right and metres up the page.
using View = Vector2d (*)(const Vector3d&);
Vector2d from_above(const Vector3d& p) { return {p.x(), p.z()}; }
Vector2d from_right(const Vector3d& p) { return {p.z(), -p.y()}; }

std::vector<DrawnCamera> drawn_cameras(const camera::Rig& rig) {
  double extent = 0.0;
  for (std::size_t i = 0; i < rig.size(); ++i) extent = std::max(extent, rig.rig_from_cam(i).translation().norm());
  const double length = extent > 1e-6 ? 0.6 * extent : 0.1;
  std::vector<DrawnCamera> drawn;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const SE3& T = rig.rig_from_cam(i);
    DrawnCamera camera{
        rig.camera(i).name, std::string(series_colour(i)), T.translation(), T * Vector3d(0, 0, 1.15 * length), {}};
    for (const Vector3d& bearing : fan_bearings(rig.camera(i))) camera.frustum.push_back(T * (length * bearing));
    drawn.push_back(std::move(camera));
  }
  return drawn;
}

// Metres to pixels, the same scale in both panels.
struct Panel2d {
  View view;
  Vector2d centre_m, centre_px;
  double px_per_m;
  Vector2d to_px(const Vector3d& p) const {
    const Vector2d d = px_per_m * (view(p) - centre_m);
    return centre_px + Vector2d(d.x(), -d.y());
  }
};

std::string points_text(const std::vector<Vector2d>& points) {
  std::string text;
  for (const Vector2d& p : points) text += fmt::format("{}{:.1f},{:.1f}", text.empty() ? "" : " ", p.x(), p.y());
  return text;
}

std::string line_text(const Vector2d& a, const Vector2d& b, std::string_view colour, double width) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{}\"/>\n", a.x(),
      a.y(), b.x(), b.y(), colour, width);
}

std::string label_text(const Vector2d& at, std::string_view colour, std::string_view anchor, int size,
                       const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\" text-anchor=\"{}\" font-size=\"{}\">{}</text>\n",
                     at.x(), at.y(), colour, anchor, size, escaped(text));
}

std::string frustum_text(const DrawnCamera& camera, const Panel2d& panel) {
  std::vector<Vector2d> points = {panel.to_px(camera.position)};
  for (const Vector3d& p : camera.frustum) points.push_back(panel.to_px(p));
  return fmt::format(
      "<polygon points=\"{0}\" fill=\"{1}\" fill-opacity=\"0.10\" stroke=\"{1}\" stroke-opacity=\"0.55\" "
      "stroke-width=\"1\" stroke-linejoin=\"round\"/>\n",
      points_text(convex_hull(std::move(points))), camera.colour);
}

std::string camera_text(const DrawnCamera& camera, const Panel2d& panel) {
  const Vector2d from = panel.to_px(camera.position), to = panel.to_px(camera.axis_end);
  std::string text;
  if ((to - from).norm() > 8) {  // otherwise the axis points towards the reader
    const Vector2d along = (to - from).normalized(), across(-along.y(), along.x());
    text += line_text(from, to - 6 * along, camera.colour, 1.8);
    text += fmt::format("<polygon points=\"{}\" fill=\"{}\"/>\n",
                        points_text({to, to - 8 * along + 3.5 * across, to - 8 * along - 3.5 * across}), camera.colour);
  }
  return text + fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" stroke=\"white\"/>\n", from.x(),
                            from.y(), camera.colour);
}

// Names next to the tips of the optical axes, moved down until they do not overlap.
std::string names_text(const std::vector<DrawnCamera>& cameras, const Panel2d& panel) {
  constexpr double kLine = 14, kReach = 90;
  std::string text;
  std::vector<Vector2d> taken;
  for (const DrawnCamera& camera : cameras) {
    const Vector2d from = panel.to_px(camera.position), to = panel.to_px(camera.axis_end);
    const bool leftwards = to.x() < from.x() - 4;
    Vector2d at = to + Vector2d(leftwards ? -7 : 7, to.y() < from.y() ? -3 : 11);
    const auto covers = [&](const Vector2d& other) {
      return std::abs(other.x() - at.x()) < kReach && std::abs(other.y() - at.y()) < kLine - 1;
    };
    while (std::any_of(taken.begin(), taken.end(), covers)) at.y() += kLine;
    taken.push_back(at);
    text += label_text(at, camera.colour, leftwards ? "end" : "start", 12, camera.name);
  }
  return text;
}

std::string body_text(const SE3& T_rig_body, const Panel2d& panel, double length) {
  if (T_rig_body.translation().norm() < 1e-9 && geometry::so3_log(T_rig_body.rotation()).norm() < 1e-9) return "";
  constexpr std::array<const char*, 3> kColours = {"#c0392b", "#27843f", "#2c5fb8"}, kNames = {"x", "y", "z"};
  std::string text;
  const Vector2d origin = panel.to_px(T_rig_body.translation());
  for (int k = 0; k < 3; ++k) {
    const Vector2d end = panel.to_px(T_rig_body * (length * Vector3d::Unit(k)));
    if ((end - origin).norm() < 6) continue;
    text += line_text(origin, end, kColours[static_cast<std::size_t>(k)], 1.4);
    text += label_text(end + Vector2d(3, -2), kColours[static_cast<std::size_t>(k)], "start", 10,
                       kNames[static_cast<std::size_t>(k)]);
  }
  return text + label_text(origin + Vector2d(-5, 12), kGrey, "end", 10, "body");
}

// A scale bar of a round length, about a fifth of a panel wide.
std::string scale_text(double px_per_m, double y) {
  double length = std::pow(10.0, std::floor(std::log10(kPanelWidth / 5 / px_per_m)));
  for (const double factor : {5.0, 2.0}) {
    if (length * factor * px_per_m < kPanelWidth / 4) {
      length *= factor;
      break;
    }
  }
  const Vector2d a(kMargin, y), b = a + Vector2d(length * px_per_m, 0);
  const std::string name = length >= 1      ? fmt::format("{:g} m", length)
                           : length >= 0.01 ? fmt::format("{:g} cm", 100 * length)
                                            : fmt::format("{:g} mm", 1000 * length);
  return line_text(a, b, kBlack, 2) + line_text(a - Vector2d(0, 4), a + Vector2d(0, 4), kBlack, 1.5) +
         line_text(b - Vector2d(0, 4), b + Vector2d(0, 4), kBlack, 1.5) +
         label_text(b + Vector2d(8, 4), kBlack, "start", 12, name);
}

struct Box {
  Vector2d low = Vector2d::Zero(), high = Vector2d::Zero();
  void add(const Vector2d& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); }
};

Box box_of(const std::vector<DrawnCamera>& cameras, const Vector3d& body, View view) {
  Box box;
  box.add(view(body));
  for (const DrawnCamera& camera : cameras) {
    box.add(view(camera.position));
    box.add(view(camera.axis_end));
    for (const Vector3d& p : camera.frustum) box.add(view(p));
  }
  return box;
}

}  // namespace

std::string rig_plot_svg(const camera::Rig& rig) {
  const std::vector<DrawnCamera> cameras = drawn_cameras(rig);
  const SE3 T_rig_body = rig.body_from_rig().inverse();
  const std::array<View, 2> views = {from_above, from_right};
  const std::array<Box, 2> boxes = {box_of(cameras, T_rig_body.translation(), views[0]),
                                    box_of(cameras, T_rig_body.translation(), views[1])};
  Vector2d size = Vector2d::Constant(1e-6);
  for (const Box& box : boxes) size = size.cwiseMax(box.high - box.low);
  const double px_per_m = std::min((kPanelWidth - kNameMargin) / size.x(), (kMaxPanelHeight - kTopMargin) / size.y());
  const double panel_height = std::max(kMinPanelHeight, px_per_m * size.y() + kTopMargin);
  const double height = kHeader + panel_height + kFooter;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      kWidth, height);
  out += label_text({kMargin, 32}, kBlack, "start", 18,
                    fmt::format("Rig of {} camera{}", rig.size(), rig.size() == 1 ? "" : "s"));
  const std::array<const char*, 2> titles = {"from above: x to the right, z up",
                                             "from the right: z to the right, y down"};
  for (std::size_t v = 0; v < 2; ++v) {
    const double left = kMargin + static_cast<double>(v) * (kPanelWidth + kMargin);
    const Panel2d panel{
        views[v], 0.5 * (boxes[v].low + boxes[v].high), {left + kPanelWidth / 2, kHeader + panel_height / 2}, px_per_m};
    out += label_text({left, kHeader - 10}, kGrey, "start", 13, titles[v]);
    out += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#fafafa\" stroke=\"#dddddd\"/>\n",
        left, kHeader, kPanelWidth, panel_height);
    for (const DrawnCamera& camera : cameras) out += frustum_text(camera, panel);
    out += body_text(T_rig_body, panel, 40 / px_per_m);
    for (const DrawnCamera& camera : cameras) out += camera_text(camera, panel);
    out += names_text(cameras, panel);
  }
  return out + scale_text(px_per_m, height - 18) + "</svg>\n";
}

}  // namespace bslam::report
