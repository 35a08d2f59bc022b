#include "estimators/epipolar.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "solver/lm.h"

namespace bslam::estimators {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector5d = Eigen::Matrix<double, 5, 1>;

constexpr double kSmall = 1e-12;  // sine below which a bearing lies on the baseline and defines no epipolar plane

// Distances along R a and b at which the rays come closest, each times the squared sine between them.
struct ScaledDistances {
  double a, b, squared_sine;
};

ScaledDistances distances(const EpipolarPose& pose, const BearingPair& pair) {
  const Vector3d f = pose.R_b_a * pair.a;
  const double c = f.dot(pair.b), ft = f.dot(pose.t_b_a), bt = pair.b.dot(pose.t_b_a);
  return {c * bt - ft, bt - c * ft, 1.0 - c * c};
}

// Two unit vectors that span the plane perpendicular to t.
Eigen::Matrix<double, 3, 2> tangent_basis(const Vector3d& t) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = t.unitOrthogonal();
  basis.col(1) = t.cross(basis.col(0));
  return basis;
}

struct SampsonTerm {
  double angle = 0.0;  // radians
  Vector5d gradient = Vector5d::Zero();
};

// r = n / D with n = b . (t x f), f = R a and D^2 = |t x f|^2 + |t x b|^2 - 2 n^2: the distance to the epipolar variety
// on the two spheres to first order. Perturbation R <- exp(omega) R, t <- t + B tau.
SampsonTerm sampson(const EpipolarPose& pose, const Eigen::Matrix<double, 3, 2>& basis, const BearingPair& pair) {
  const Vector3d &t = pose.t_b_a, &b = pair.b, f = pose.R_b_a * pair.a;
  const Vector3d plane = t.cross(f);
  const double n = b.dot(plane), tf = t.dot(f), tb = t.dot(b);
  const double D2 = 2.0 - tf * tf - tb * tb - 2.0 * n * n;
  SampsonTerm out;
  if (!(D2 > kSmall)) return out;
  Vector5d dn, dD2;
  dn.head<3>() = f.cross(b.cross(t));
  dn.tail<2>() = basis.transpose() * f.cross(b);
  dD2.head<3>() = -2.0 * tf * f.cross(t);
  dD2.tail<2>() = basis.transpose() * (-2.0 * tf * f - 2.0 * tb * b);
  dD2 -= 4.0 * n * dn;
  const double D = std::sqrt(D2);
  out.angle = n / D;
  out.gradient = dn / D - (0.5 * n / (D2 * D)) * dD2;
  return out;
}

using Equations = solver::NormalEquations<5>;

Equations linearise(const EpipolarPose& pose, const Eigen::Matrix<double, 3, 2>& basis,
                    std::span<const BearingPair> pairs, const std::vector<std::uint8_t>& use, double knee) {
  Equations out;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (use[i] == 0) continue;
    const SampsonTerm term = sampson(pose, basis, pairs[i]);
    const double size = std::abs(term.angle);
    const double weight = size <= knee ? 1.0 : knee / size;
    out.cost += size <= knee ? 0.5 * size * size : knee * (size - 0.5 * knee);
    out.H += weight * term.gradient * term.gradient.transpose();
    out.b -= weight * term.angle * term.gradient;
  }
  return out;
}

EpipolarPose moved(const EpipolarPose& pose, const Eigen::Matrix<double, 3, 2>& basis, const Vector5d& delta) {
  const Matrix3d R =
      (geometry::so3_exp(delta.head<3>()) * Eigen::Quaterniond(pose.R_b_a)).normalized().toRotationMatrix();
  return {R, (pose.t_b_a + basis * delta.tail<2>()).normalized()};
}

}  // namespace

double epipolar_angle(const EpipolarPose& pose, const BearingPair& pair) {
  const Vector3d f = pose.R_b_a * pair.a;
  const double n = std::abs(pair.b.dot(pose.t_b_a.cross(f)));
  const double sine = std::min(pose.t_b_a.cross(f).norm(), pose.t_b_a.cross(pair.b).norm());
  // A bearing on the baseline defines no epipolar plane; the other bearing must then lie on the baseline, too.
  if (!(sine > kSmall)) return std::max(pose.t_b_a.cross(f).norm(), pose.t_b_a.cross(pair.b).norm());
  return std::asin(std::min(1.0, n / sine));
}

bool in_front_of_both(const EpipolarPose& pose, const BearingPair& pair) {
  const ScaledDistances d = distances(pose, pair);
  return d.a > 0.0 && d.b > 0.0;
}

Vector3d midpoint_in_a(const EpipolarPose& pose, const BearingPair& pair) {
  const ScaledDistances d = distances(pose, pair);
  const double scale = 1.0 / std::max(d.squared_sine, kSmall);
  const Vector3d on_b = pose.R_b_a.transpose() * (d.b * scale * pair.b - pose.t_b_a);
  return 0.5 * (d.a * scale * pair.a + on_b);
}

EpipolarPose refine_epipolar(const EpipolarPose& start, std::span<const BearingPair> pairs,
                             const std::vector<std::uint8_t>& use, double knee) {
  struct State {
    EpipolarPose pose;
    Eigen::Matrix<double, 3, 2> basis;  // basis of the translation's two degrees of freedom
  };
  const auto equations_at = [&](const State& s) { return linearise(s.pose, s.basis, pairs, use, knee); };
  const auto plus = [](const State& s, const Vector5d& delta) {
    const EpipolarPose pose = moved(s.pose, s.basis, delta);
    return State{pose, tangent_basis(pose.t_b_a)};
  };
  const State state{start, tangent_basis(start.t_b_a)};
  solver::SmallProblem<5, State, decltype(equations_at), decltype(plus)> problem(state, equations_at(state),
                                                                                 equations_at, plus);
  solver::minimise(problem, {.iterations = 15,
                             .relative_decrease = 0.0,
                             .min_gain = 0.0,
                             .rule = solver::DampingRule::kOnFailure,
                             .unit_cost = knee * knee});
  return problem.state().pose;
}

}  // namespace bslam::estimators
