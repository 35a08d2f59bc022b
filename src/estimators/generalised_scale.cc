#include "estimators/generalised_scale.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "solver/lm.h"

namespace bslam::estimators {
namespace {

using Eigen::Vector3d;
using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr int kDistances = 13;           // number of initial distances, equidistant in their logarithm
constexpr double kMinSigma = 1e-5;       // rad, minimum standard deviation of a bearing
constexpr double kMinCondition = 1e-12;  // minimum condition of the normal equations; if smaller, it is not observable
// A motion is excluded if its cost exceeds the best cost by that of three standard deviations, where ten correlated
// pairs carry as much information as one.
constexpr double kExcludingSigmas = 3.0, kCorrelatedPairs = 10.0;

// `cost`: half the sum of squared angles, each at most the square of the camera's `inlier_angle`.
struct Sums : solver::NormalEquations<6> {
  double squared = 0.0;  // sum of squared angles of the inliers
  int inliers = 0;
};

// Squared Sampson angle of every pair to the epipolar plane of its camera's motion, truncated at its `inlier_angle`.
// With x = R a and the motion of the camera perturbed by [omega, v], b . (t x R a) changes by v . (x x b) + omega . ((t
// x x) x b). A change of the length of t changes no angle. This component is removed from v's derivative; otherwise
// noise would appear as information about the distance.
Sums evaluate(const SE3& T_b_a, std::span<const CameraPairs> cameras) {
  Sums out;
  for (const CameraPairs& camera : cameras) {
    const SE3 T = camera.T_cam_ref * T_b_a * camera.T_cam_ref.inverse();
    const Matrix3d R = T.matrix3();
    const Matrix6d adjoint = camera.T_cam_ref.adjoint();
    const Vector3d& t = T.translation();
    const Vector3d along = t.norm() > 0.0 ? Vector3d(t.normalized()) : Vector3d::Zero();
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (const BearingPair& pair : camera.pairs) {
      const Vector3d x = R * pair.a, normal = t.cross(x), other = pair.b.cross(t);
      const double rotated = pair.b.dot(normal);
      const double spread =
          std::sqrt((normal - rotated * pair.b).squaredNorm() + (other - x.dot(other) * x).squaredNorm());
      const double angle = spread > 0.0 ? rotated / spread : 0.0;
      if (!(std::abs(angle) < camera.inlier_angle)) {
        out.cost += 0.5 * camera.inlier_angle * camera.inlier_angle;
        continue;
      }
      const Vector3d moved = x.cross(pair.b);
      Vector6d J;
      J << normal.cross(pair.b), moved - along * along.dot(moved);
      if (spread > 0.0) J /= spread;
      H += J * J.transpose();
      g -= angle * J;
      out.cost += 0.5 * angle * angle;
      out.squared += angle * angle;
      ++out.inliers;
    }
    out.H += adjoint.transpose() * H * adjoint;
    out.b += adjoint.transpose() * g;
  }
  return out;
}

SE3 at_distance(const SE3& T, double distance) { return {T.rotation(), distance * T.translation().normalized()}; }

SE3 refine(const SE3& T_b_a, std::span<const CameraPairs> cameras) {
  const auto equations_at = [&](const SE3& T) -> solver::NormalEquations<6> { return evaluate(T, cameras); };
  const double knee = std::ranges::max(cameras, {}, &CameraPairs::inlier_angle).inlier_angle;
  const auto plus = [](const SE3& T, const Vector6d& delta) { return T.perturbed(delta); };
  solver::SmallProblem<6, SE3, decltype(equations_at), decltype(plus)> problem(T_b_a, equations_at(T_b_a), equations_at,
                                                                               plus);
  solver::minimise(problem, {.iterations = 20,
                             .relative_decrease = 0.0,
                             .min_gain = 0.0,
                             .rule = solver::DampingRule::kOnFailure,
                             .unit_cost = knee * knee});
  return problem.state();
}

struct Motion {
  SE3 T_b_a;
  Sums sums;
};

// The motions refined from different distances along the given direction. The cost has several minima: if the map is
// small enough, each camera moves in a direction of its own.
std::vector<Motion> refined_motions(const SE3& T_b_a, std::span<const CameraPairs> cameras,
                                    const GeneralisedScaleOptions& options) {
  std::vector<Motion> out;
  for (int i = 0; i < kDistances; ++i) {
    const double fraction = static_cast<double>(i) / (kDistances - 1);
    const double distance = options.shortest * std::pow(options.longest / options.shortest, fraction);
    const SE3 T = refine(at_distance(T_b_a, distance), cameras);
    out.push_back({T, evaluate(T, cameras)});
  }
  return out;
}

// The largest ratio, as a logarithm, of the distance of a motion that is not excluded to that of the best one. `limit`:
// difference of costs.
double spread(const std::vector<Motion>& motions, const Motion& best, double limit) {
  double out = 0.0;
  for (const Motion& m : motions) {
    if (m.sums.cost - best.sums.cost < limit)
      out = std::max(out, std::abs(std::log(m.T_b_a.translation().norm() / best.T_b_a.translation().norm())));
  }
  return out;
}

}  // namespace

std::optional<GeneralisedScale> generalised_scale(const SE3& T_b_a, std::span<const CameraPairs> cameras,
                                                  const GeneralisedScaleOptions& options) {
  if (cameras.empty() || !(T_b_a.translation().norm() > 0.0)) return std::nullopt;
  GeneralisedScale out;
  const std::vector<Motion> motions = refined_motions(T_b_a, cameras, options);
  const Motion& best = *std::ranges::min_element(motions, {}, [](const Motion& m) { return m.sums.cost; });
  const Sums& sums = best.sums;
  out.T_b_a = best.T_b_a;
  const double distance = out.T_b_a.translation().norm();
  if (sums.inliers <= 6 || !(distance > 0.0)) return std::nullopt;
  const Eigen::LDLT<Matrix6d> factor(sums.H);
  if (!factor.isPositive() || !(factor.rcond() > kMinCondition)) return std::nullopt;
  Vector6d per_step = Vector6d::Zero();  // d log(distance) / d[omega, v]
  per_step.tail<3>() = out.T_b_a.translation() / (distance * distance);
  const double variance = std::max(kMinSigma * kMinSigma, sums.squared / (sums.inliers - 6));
  const double limit = 0.5 * kExcludingSigmas * kExcludingSigmas * kCorrelatedPairs * variance;
  out.deviation = std::max(std::sqrt(variance * per_step.dot(factor.solve(per_step))), spread(motions, best, limit));
  if (!std::isfinite(out.deviation) || distance < options.shortest || distance > options.longest) return std::nullopt;
  return out;
}

}  // namespace bslam::estimators
