#include "frame/epipolar_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "feature/hamming.h"

namespace bslam::frame {
namespace {

using Eigen::Vector3d;

constexpr double kMaxWindow = 0.25;      // radians about the baseline: wider means next to the epipole
constexpr double kSamePlace = 4.0;       // standard deviations: the same corner found on two levels

// A bearing seen from the baseline: angle about it, angle from it (at this camera), angular standard deviation.
struct Polar {
  double about = 0, from = 0, sigma = 0;
  std::uint32_t keypoint = 0;
};

struct BaselineFrame {
  Vector3d e, x, y;
  explicit BaselineFrame(const Vector3d& baseline) : e(baseline.normalized()), x(e.unitOrthogonal()), y(e.cross(x)) {}
};

std::vector<Polar> to_polar(const EpipolarView& view, const BaselineFrame& frame) {
  std::vector<Polar> out;
  out.reserve(view.keypoints->size());
  const double radians_per_px = view.camera->radians_per_pixel();
  for (std::size_t k = 0; k < view.keypoints->size(); ++k) {
    if (!view.usable.empty() && !view.usable[k]) continue;
    const Vector3d d = view.T_common_cam.rotation() * view.keypoints->bearing[k];
    const double u = d.dot(frame.x), v = d.dot(frame.y);
    out.push_back({std::atan2(v, u), std::atan2(std::hypot(u, v), d.dot(frame.e)),
                   view.keypoints->sigma[k] * radians_per_px, static_cast<std::uint32_t>(k)});
  }
  return out;
}

// Angle from the baseline at the second camera of a point at `distance` along a ray that leaves the first under `from`.
double angle_at_second(double from, double distance, double baseline) {
  return std::atan2(distance * std::sin(from), distance * std::cos(from) - baseline);
}

struct Best {
  int hamming = 1 << 20, second = 1 << 20;
  const Polar* polar = nullptr;
};

}  // namespace

std::vector<EpipolarMatch> match_epipolar(const EpipolarView& a, const EpipolarView& b, const EpipolarOptions& options) {
  std::vector<EpipolarMatch> matches;
  const Vector3d baseline = b.T_common_cam.translation() - a.T_common_cam.translation();
  const double length = baseline.norm();
  if (!(length > 1e-6) || a.keypoints->empty() || b.keypoints->empty()) return matches;
  const BaselineFrame frame(baseline);
  const std::vector<Polar> polar_a = to_polar(a, frame);
  std::vector<Polar> polar_b = to_polar(b, frame);
  double max_sigma_b = 0;
  for (std::size_t i = 0, n = polar_b.size(); i < n; ++i) {
    max_sigma_b = std::max(max_sigma_b, polar_b[i].sigma);
    for (const double turn : {-2 * std::numbers::pi, 2 * std::numbers::pi}) {  // so that windows need not wrap around
      if (std::abs(polar_b[i].about + turn) > std::numbers::pi + kMaxWindow) continue;
      Polar copy = polar_b[i];
      copy.about += turn;
      polar_b.push_back(copy);
    }
  }
  std::sort(polar_b.begin(), polar_b.end(), [](const Polar& p, const Polar& q) {
    return p.about != q.about ? p.about < q.about : p.keypoint < q.keypoint;
  });

  std::vector<std::pair<int, std::uint32_t>> best_of_b(b.keypoints->size(), {1 << 20, 0});  // (hamming, position in matches)
  for (const Polar& p : polar_a) {
    const double sine = std::sin(p.from);
    const double window = options.sigmas * std::hypot(p.sigma, max_sigma_b) / std::max(sine, 1e-9);
    if (!(window < kMaxWindow)) continue;
    const double nearest = angle_at_second(p.from, options.near_m, length);
    const double farthest = angle_at_second(p.from, options.far_m, length);
    const feature::Descriptor& descriptor = a.keypoints->descriptor[p.keypoint];
    const int level = a.keypoints->level[p.keypoint];
    auto it = std::lower_bound(polar_b.begin(), polar_b.end(), p.about - window,
                               [](const Polar& q, double value) { return q.about < value; });
    Best best;
    const auto first = it;
    for (; it != polar_b.end() && it->about <= p.about + window; ++it) {
      const double slack = options.sigmas * std::hypot(p.sigma, it->sigma);
      if (std::abs(it->about - p.about) * sine > slack) continue;
      if (it->from < farthest - slack || it->from > nearest + slack) continue;
      if (std::abs(b.keypoints->level[it->keypoint] - level) > options.max_level_difference) continue;
      const int distance = feature::hamming(descriptor, b.keypoints->descriptor[it->keypoint]);
      if (distance < best.hamming) best = {distance, best.second, &*it};
    }
    if (best.polar == nullptr || best.hamming > options.max_hamming) continue;
    for (auto other = first; other != it; ++other) {  // the runner-up at another place
      const double slack = options.sigmas * std::hypot(p.sigma, other->sigma);
      if (std::abs(other->from - best.polar->from) < kSamePlace * std::max(other->sigma, best.polar->sigma)) continue;
      if (std::abs(other->about - p.about) * sine > slack || other->from < farthest - slack || other->from > nearest + slack) continue;
      best.second = std::min(best.second, feature::hamming(descriptor, b.keypoints->descriptor[other->keypoint]));
    }
    if (best.hamming > options.ratio * best.second) continue;
    auto& [distance, position] = best_of_b[best.polar->keypoint];
    if (best.hamming >= distance) continue;  // an earlier keypoint of a fits as well or better
    if (distance < (1 << 20)) matches[position].hamming = -1;
    distance = best.hamming;
    position = static_cast<std::uint32_t>(matches.size());
    matches.push_back({KeypointIndex(static_cast<std::int32_t>(p.keypoint)),
                       KeypointIndex(static_cast<std::int32_t>(best.polar->keypoint)), best.hamming});
  }
  std::erase_if(matches, [](const EpipolarMatch& m) { return m.hamming < 0; });
  return matches;
}

}  // namespace bslam::frame
