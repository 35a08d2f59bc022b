#include "matching/epipolar_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "feature/hamming.h"

namespace bslam::matching {
namespace {

using Eigen::Vector3d;

constexpr double kMaxWindow = 0.25;  // rad around the baseline; wider windows occur near the epipole
constexpr double kSamePlace = 4.0;   // standard deviations; closer keypoints are the same corner on two levels

// A bearing relative to the baseline: angle around it, angle to it (at this camera) with its sine and cosine, angular
// standard deviation; level of its keypoint in the pyramid of the second camera.
struct Polar {
  double about = 0, from = 0, sine = 0, cosine = 0, sigma = 0;
  int level = 0;
  std::uint32_t keypoint = 0;
};

// Number of levels by which the images of camera b are finer than those of camera a.
int levels_finer(const camera::Camera& a, const camera::Camera& b, double scale_factor) {
  return static_cast<int>(
      std::lround(std::log(a.radians_per_pixel() / b.radians_per_pixel()) / std::log(scale_factor)));
}

// Standard deviation of a difference.
double both(double sigma_a, double sigma_b) { return std::sqrt(sigma_a * sigma_a + sigma_b * sigma_b); }

struct BaselineFrame {
  Vector3d e, x, y;
  explicit BaselineFrame(const Vector3d& baseline) : e(baseline.normalized()), x(e.unitOrthogonal()), y(e.cross(x)) {}
};

// Standard deviations of the keypoints in radians.
class AngularDeviation {
 public:
  explicit AngularDeviation(const EpipolarView& view)
      : keypoints_(*view.keypoints), radians_per_px_(view.camera->radians_per_pixel()) {
    if (view.features == nullptr || keypoints_.empty()) return;
    const int coarsest = std::ranges::max(keypoints_.level);
    for (int l = 0; l <= coarsest; ++l) of_level_.push_back(view.features->sigma(l) * radians_per_px_);
  }
  double operator()(std::size_t k) const {
    return of_level_.empty() ? keypoints_.sigma[k] * radians_per_px_
                             : of_level_[static_cast<std::size_t>(keypoints_.level[k])];
  }

 private:
  const feature::Keypoints& keypoints_;
  double radians_per_px_;
  std::vector<double> of_level_;  // empty: each keypoint has its own
};

// `finer`: number of levels by which the images of the second camera are finer.
std::vector<Polar> to_polar(const EpipolarView& view, const BaselineFrame& frame, int finer) {
  std::vector<Polar> out;
  out.reserve(view.keypoints->size());
  const AngularDeviation sigma(view);
  for (std::size_t k = 0; k < view.keypoints->size(); ++k) {
    if (!view.usable.empty() && !view.usable[k]) continue;
    const double pixel_y = static_cast<double>(view.keypoints->pixel[k].y());
    const Vector3d d =
        view.T_common_cam.rotation() * view.shutter.bearing_at_middle(view.keypoints->bearing[k], pixel_y);
    const double u = d.dot(frame.x), v = d.dot(frame.y), sine = std::sqrt(u * u + v * v), cosine = d.dot(frame.e);
    out.push_back({std::atan2(v, u), std::atan2(sine, cosine), sine, cosine, sigma(k), view.keypoints->level[k] + finer,
                   static_cast<std::uint32_t>(k)});
  }
  return out;
}

// Angle to the baseline at the second camera of a point at `distance` on the ray `p` of the first camera.
double angle_at_second(const Polar& p, double distance, double baseline) {
  return std::atan2(distance * p.sine, distance * p.cosine - baseline);
}

// Keypoints of b in order of their angle around the baseline. Those near +-pi are repeated at the other end, so that
// windows do not wrap around.
struct SortedView {
  std::vector<Polar> polar;
  double max_sigma = 0;
};

SortedView sorted_view(const EpipolarView& view, const BaselineFrame& frame) {
  SortedView out{to_polar(view, frame, 0), 0};
  for (std::size_t i = 0, n = out.polar.size(); i < n; ++i) {
    out.max_sigma = std::max(out.max_sigma, out.polar[i].sigma);
    for (const double turn : {-2 * std::numbers::pi, 2 * std::numbers::pi}) {
      if (std::abs(out.polar[i].about + turn) > std::numbers::pi + kMaxWindow) continue;
      Polar copy = out.polar[i];
      copy.about += turn;
      out.polar.push_back(copy);
    }
  }
  std::sort(out.polar.begin(), out.polar.end(), [](const Polar& p, const Polar& q) {
    return p.about != q.about ? p.about < q.about : p.keypoint < q.keypoint;
  });
  return out;
}

struct Best {
  int hamming = 0;
  std::uint32_t keypoint = 0;
};

// The keypoint of b most similar to keypoint `p` of a, if it is clearly more similar than keypoints at other positions.
std::optional<Best> best_match(const Polar& p, const EpipolarView& a, const EpipolarView& b, const SortedView& sorted,
                               double baseline, const EpipolarOptions& options, std::vector<const Polar*>& candidates) {
  const double window = options.sigmas * both(p.sigma, sorted.max_sigma) / std::max(p.sine, 1e-9);
  if (!(window < kMaxWindow)) return std::nullopt;
  const double nearest = angle_at_second(p, options.min_depth_m, baseline);
  const double farthest = angle_at_second(p, options.max_depth_m, baseline);
  const feature::Descriptor& descriptor = a.keypoints->descriptor[p.keypoint];
  candidates.clear();
  int best = options.max_hamming + 1;
  const Polar* found = nullptr;
  auto it = std::lower_bound(sorted.polar.begin(), sorted.polar.end(), p.about - window,
                             [](const Polar& q, double value) { return q.about < value; });
  for (; it != sorted.polar.end() && it->about <= p.about + window; ++it) {
    const double slack = options.sigmas * both(p.sigma, it->sigma);
    if (std::abs(it->about - p.about) * p.sine > slack) continue;
    if (it->from < farthest - slack || it->from > nearest + slack) continue;
    if (std::abs(it->level - p.level) > options.max_level_difference) continue;
    candidates.push_back(&*it);
    const int distance = feature::hamming(descriptor, b.keypoints->descriptor[it->keypoint]);
    if (distance < best) {
      best = distance;
      found = &*it;
    }
  }
  if (found == nullptr) return std::nullopt;
  for (const Polar* other : candidates) {
    if (std::abs(other->from - found->from) < kSamePlace * std::max(other->sigma, found->sigma)) continue;
    if (best > options.ratio * feature::hamming(descriptor, b.keypoints->descriptor[other->keypoint]))
      return std::nullopt;
  }
  return Best{best, found->keypoint};
}

}  // namespace

std::vector<EpipolarMatch> match_epipolar(const EpipolarView& a, const EpipolarView& b,
                                          const EpipolarOptions& options) {
  std::vector<EpipolarMatch> matches;
  const Vector3d baseline = b.T_common_cam.translation() - a.T_common_cam.translation();
  const double length = baseline.norm();
  if (!(length > 1e-6) || a.keypoints->empty() || b.keypoints->empty()) return matches;
  const BaselineFrame frame(baseline);
  const SortedView sorted = sorted_view(b, frame);
  constexpr int kNone = 1 << 20;
  std::vector<std::pair<int, std::uint32_t>> owner(b.keypoints->size(), {kNone, 0});  // (hamming, position in matches)
  std::vector<const Polar*> candidates;
  const int finer = levels_finer(*a.camera, *b.camera, options.scale_factor);
  for (const Polar& p : to_polar(a, frame, finer)) {
    const auto best = best_match(p, a, b, sorted, length, options, candidates);
    if (!best) continue;
    auto& [distance, position] = owner[best->keypoint];
    if (best->hamming >= distance) continue;  // an earlier keypoint of a is at least as similar
    if (distance < kNone) matches[position].hamming = -1;
    distance = best->hamming;
    position = static_cast<std::uint32_t>(matches.size());
    matches.push_back({KeypointIndex(static_cast<std::int32_t>(p.keypoint)),
                       KeypointIndex(static_cast<std::int32_t>(best->keypoint)), best->hamming});
  }
  std::erase_if(matches, [](const EpipolarMatch& m) { return m.hamming < 0; });
  return matches;
}

}  // namespace bslam::matching
