#include "estimators/relative_pose.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <numeric>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>

#include "base/median.h"
#include "estimators/epipolar.h"
#include "geometry/triangulation.h"

namespace bslam::estimators {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kSampleSize = 5;
constexpr double kConfidence = 0.999;  // probability of a sample without outliers at which sampling stops
constexpr int kMinSamples = 50;        // required to find alternative solutions
constexpr std::size_t kMaxRivals = 24;
// The solution is ambiguous if another one differs by more than this in rotation or direction of motion, and has at
// least this fraction of the inliers of the best one.
constexpr double kDistinctRotation = 0.02, kDistinctDirection = 0.2;  // radians
constexpr double kAmbiguousInlierRatio = 0.8;

struct Candidate {
  EpipolarPose pose;
  double cost = std::numeric_limits<double>::infinity();
};

// The two rotations and two signs of translation of an essential matrix E = [t]x R (Hartley and Zisserman, 9.6.2).
std::array<EpipolarPose, 4> decompose(const Matrix3d& E) {
  const Eigen::JacobiSVD<Matrix3d> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d W = (Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
  const Eigen::Vector3d t = svd.matrixU().col(2);
  Matrix3d R1 = svd.matrixU() * W * svd.matrixV().transpose();
  Matrix3d R2 = svd.matrixU() * W.transpose() * svd.matrixV().transpose();
  if (R1.determinant() < 0) R1 = -R1;
  if (R2.determinant() < 0) R2 = -R2;
  return {EpipolarPose{R1, t}, EpipolarPose{R1, -t}, EpipolarPose{R2, t}, EpipolarPose{R2, -t}};
}

std::array<std::size_t, kSampleSize> draw(std::size_t count, Random& random) {
  std::array<std::size_t, kSampleSize> out{};
  for (std::size_t k = 0; k < kSampleSize;) {
    out[k] = random.below(static_cast<std::uint32_t>(count));
    if (std::find(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(k), out[k]) ==
        out.begin() + static_cast<std::ptrdiff_t>(k)) {
      ++k;
    }
  }
  return out;
}

// OpenGV throws for degenerate samples, such as points that have not moved.
opengv::essentials_t essential_matrices(const opengv::relative_pose::CentralRelativeAdapter& adapter) {
  try {
    return opengv::relative_pose::fivept_nister(adapter);
  } catch (const std::exception&) {
    return {};
  }
}

// Poses of the five-point algorithm that have all five points in front of both cameras. OpenGV's viewpoint 1 is our b
// and its viewpoint 2 our a, for its E = [t]x R maps from 2 to 1.
void solve_sample(std::span<const BearingPair> pairs, const std::array<std::size_t, kSampleSize>& sample,
                  std::vector<EpipolarPose>& out) {
  opengv::bearingVectors_t a, b;
  for (const std::size_t i : sample) {
    a.push_back(pairs[i].a);
    b.push_back(pairs[i].b);
  }
  const opengv::relative_pose::CentralRelativeAdapter adapter(b, a);
  out.clear();
  for (const auto& E : essential_matrices(adapter)) {
    if (!E.allFinite()) continue;
    for (const EpipolarPose& pose : decompose(E)) {
      const bool in_front =
          std::all_of(sample.begin(), sample.end(), [&](std::size_t i) { return in_front_of_both(pose, pairs[i]); });
      if (in_front) out.push_back(pose);
    }
  }
}

// Sum of truncated squared angles, in units of the inlier bound. Returns a partial sum once it exceeds `limit`.
double truncated_cost(const EpipolarPose& pose, std::span<const BearingPair> pairs, double bound, double limit) {
  double cost = 0.0;
  for (const BearingPair& pair : pairs) {
    const double error = epipolar_angle(pose, pair) / bound;
    cost += error < 1.0 && in_front_of_both(pose, pair) ? error * error : 1.0;
    if (cost > limit) break;
  }
  return cost;
}

std::vector<std::uint8_t> inliers(const EpipolarPose& pose, std::span<const BearingPair> pairs, double bound) {
  std::vector<std::uint8_t> out;
  out.reserve(pairs.size());
  for (const BearingPair& pair : pairs) {
    out.push_back(epipolar_angle(pose, pair) < bound && in_front_of_both(pose, pair));
  }
  return out;
}

int count(const std::vector<std::uint8_t>& mask) { return std::accumulate(mask.begin(), mask.end(), 0); }

bool distinct(const EpipolarPose& x, const EpipolarPose& y) {
  const double rotation = Eigen::AngleAxisd(x.R_b_a * y.R_b_a.transpose()).angle();
  const double direction = geometry::angle_between(x.t_b_a, y.t_b_a);
  return rotation > kDistinctRotation || direction > kDistinctDirection;
}

// Keeps the candidates of lowest cost, in order of cost.
void keep(std::vector<Candidate>& best, const Candidate& candidate) {
  const auto at = std::upper_bound(best.begin(), best.end(), candidate,
                                   [](const Candidate& x, const Candidate& y) { return x.cost < y.cost; });
  best.insert(at, candidate);
  if (best.size() > kMaxRivals) best.pop_back();
}

std::vector<Candidate> sample_candidates(std::span<const BearingPair> pairs, const RelativePoseOptions& options,
                                         Random& random) {
  std::vector<Candidate> best;
  std::vector<EpipolarPose> poses;
  double needed = options.iterations;
  for (int i = 0; i < options.iterations && i < std::max<double>(kMinSamples, needed); ++i) {
    solve_sample(pairs, draw(pairs.size(), random), poses);
    for (const EpipolarPose& pose : poses) {
      const double limit = best.size() < kMaxRivals ? std::numeric_limits<double>::infinity() : best.back().cost;
      const double cost = truncated_cost(pose, pairs, options.inlier_angle, limit);
      if (cost >= limit) continue;
      const bool improved = best.empty() || cost < best.front().cost;
      keep(best, {pose, cost});
      if (!improved) continue;
      const double inlier_ratio = count(inliers(pose, pairs, options.inlier_angle)) / static_cast<double>(pairs.size());
      needed = std::log(1.0 - kConfidence) / std::log1p(-std::min(std::pow(inlier_ratio, 5), 1.0 - 1e-12));
    }
  }
  return best;
}

// Least squares over the inliers, repeated with the inliers of the result.
EpipolarPose refine_and_reselect(const EpipolarPose& start, std::span<const BearingPair> pairs, double bound) {
  EpipolarPose pose = start;
  for (int round = 0; round < 3; ++round) pose = refine_epipolar(pose, pairs, inliers(pose, pairs, bound), bound);
  return pose;
}

RelativePose describe(const EpipolarPose& pose, std::span<const BearingPair> pairs, double bound) {
  RelativePose out;
  out.T_b_a = geometry::SE3(pose.R_b_a, pose.t_b_a);
  out.inlier = inliers(pose, pairs, bound);
  out.num_inliers = count(out.inlier);
  out.points_a.assign(pairs.size(), Eigen::Vector3d::Zero());
  std::vector<double> parallax;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (out.inlier[i] == 0) continue;
    out.points_a[i] = midpoint_in_a(pose, pairs[i]);
    parallax.push_back(geometry::angle_between(pose.R_b_a * pairs[i].a, pairs[i].b));
  }
  if (!parallax.empty()) out.median_parallax = median(std::move(parallax));
  return out;
}

// The pairs that have moved, if these show much motion. The others may be on a part of the robot, or a reflection in
// it: they agree with every translation without a rotation, and would make it ambiguous. Without much motion, or if
// nothing stands still, all pairs.
std::vector<std::size_t> moving_pairs(std::span<const BearingPair> pairs, const RelativePoseOptions& options) {
  constexpr double kUnmoved = 0.5;  // of the inlier angle
  std::vector<std::size_t> all(pairs.size()), moving;
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<double> angles;
  for (const std::size_t i : all) {
    const double angle = geometry::angle_between(pairs[i].a, pairs[i].b);
    if (angle < kUnmoved * options.inlier_angle) continue;
    moving.push_back(i);
    angles.push_back(angle);
  }
  return angles.empty() || median(std::move(angles)) < options.min_parallax ? all : moving;
}

// relative_pose() with all pairs.
std::optional<RelativePose> pose_of_all(std::span<const BearingPair> pairs, const RelativePoseOptions& options,
                                        Random random) {
  if (pairs.size() < std::max<std::size_t>(kSampleSize, static_cast<std::size_t>(std::max(0, options.min_inliers)))) {
    return std::nullopt;
  }
  std::vector<Candidate> candidates = sample_candidates(pairs, options, random);
  if (candidates.empty()) return std::nullopt;
  for (Candidate& c : candidates) {
    c.pose = refine_and_reselect(c.pose, pairs, options.inlier_angle);
    c.cost = truncated_cost(c.pose, pairs, options.inlier_angle, std::numeric_limits<double>::infinity());
  }
  const Candidate& best = *std::min_element(candidates.begin(), candidates.end(),
                                            [](const Candidate& x, const Candidate& y) { return x.cost < y.cost; });
  RelativePose out = describe(best.pose, pairs, options.inlier_angle);
  if (out.num_inliers < options.min_inliers || out.median_parallax < options.min_parallax) return std::nullopt;
  const bool ambiguous = std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return distinct(c.pose, best.pose) &&
           count(inliers(c.pose, pairs, options.inlier_angle)) >= kAmbiguousInlierRatio * out.num_inliers;
  });
  if (ambiguous) return std::nullopt;
  return out;
}

}  // namespace

std::vector<BearingPair> bearing_pairs(std::span<const PixelPair> pixels, const camera::Camera& of_a,
                                       const camera::Camera& of_b) {
  std::vector<BearingPair> out;
  for (const PixelPair& pair : pixels) {
    const auto a = of_a.unproject(pair.a), b = of_b.unproject(pair.b);
    if (a && b) out.push_back({*a, *b});
  }
  return out;
}

std::optional<RelativePose> relative_pose(std::span<const BearingPair> pairs, const RelativePoseOptions& options,
                                          Random random) {
  if (!options.leave_out_unmoved) return pose_of_all(pairs, options, random);
  const std::vector<std::size_t> moving = moving_pairs(pairs, options);
  std::vector<BearingPair> chosen;
  for (const std::size_t i : moving) chosen.push_back(pairs[i]);
  const auto pose = pose_of_all(chosen, options, random);
  if (!pose) return std::nullopt;
  RelativePose out = *pose;
  out.inlier.assign(pairs.size(), 0);
  out.points_a.assign(pairs.size(), Vector3d::Zero());
  for (std::size_t k = 0; k < moving.size(); ++k) {
    out.inlier[moving[k]] = pose->inlier[k];
    out.points_a[moving[k]] = pose->points_a[k];
  }
  return out;
}

}  // namespace bslam::estimators
