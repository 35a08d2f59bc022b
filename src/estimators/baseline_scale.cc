#include "estimators/baseline_scale.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace bslam::estimators {
namespace {

using Eigen::Vector3d;

// The unknown is the inverse of the scale, in which the equations bearing x (direction + inverse * offset) = 0 are
// linear.
struct Equation {
  Vector3d constant, linear;  // of the cross product
  double inverse = 0;         // its own solution
};

double angle(const BaselineObservation& s, const Equation& e, double inverse) {
  const Vector3d direction = s.direction + inverse * s.offset;
  const double cosine = s.bearing.dot(direction);
  return std::atan2((e.constant + inverse * e.linear).norm(), cosine);
}

struct Agreement {
  int count = 0;
  double inverse = 0;   // refined over the observations that agree
  double residual = 0;  // root mean square of their angles, rad
  double parallax = 0;  // root mean square of the angles by which the offset moves them, rad
};

// Observations that agree with this inverse scale, and the least-squares solution of them.
Agreement agreement(std::span<const BaselineObservation> observations, std::span<const Equation> equations,
                    double inverse, double tolerance) {
  Agreement out;
  double numerator = 0.0, denominator = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const double error = angle(observations[i], equations[i], inverse);
    if (error > tolerance) continue;
    const double weight = 1.0 / (observations[i].direction + inverse * observations[i].offset).squaredNorm();
    numerator -= weight * equations[i].linear.dot(equations[i].constant);
    denominator += weight * equations[i].linear.squaredNorm();
    squares += error * error;
    ++out.count;
  }
  if (out.count == 0 || denominator == 0.0) return {};
  out.inverse = numerator / denominator;
  out.residual = std::sqrt(squares / out.count);
  out.parallax = std::abs(out.inverse) * std::sqrt(denominator / out.count);
  return out;
}

}  // namespace

std::optional<BaselineScale> baseline_scale(std::span<const BaselineObservation> observations,
                                            const BaselineScaleOptions& options) {
  constexpr int kRefinements = 3;
  constexpr std::size_t kHypotheses = 200;
  constexpr double kMinDeviation = 0.01;  // errors of the extrinsics are common to all, too
  std::vector<Equation> equations;
  for (const BaselineObservation& s : observations) {
    Equation e{s.bearing.cross(s.direction), s.bearing.cross(s.offset), 0.0};
    e.inverse = -e.linear.dot(e.constant) / std::max(e.linear.squaredNorm(), 1e-18);
    equations.push_back(e);
  }
  Agreement best;
  const std::size_t step = 1 + equations.size() / kHypotheses;
  for (std::size_t i = 0; i < equations.size(); i += step) {
    if (equations[i].inverse <= 0.0) continue;
    const Agreement found = agreement(observations, equations, equations[i].inverse, options.tolerance);
    if (found.count > best.count) best = found;
  }
  for (int i = 0; i < kRefinements && best.count > 0; ++i)
    best = agreement(observations, equations, best.inverse, options.tolerance);
  const double needed =
      std::max<double>(options.min_agreeing, options.min_fraction * static_cast<double>(observations.size()));
  if (best.count < needed || best.inverse <= 0.0) return std::nullopt;
  const double deviation = std::max(best.residual / best.parallax, kMinDeviation);
  if (deviation > options.max_deviation) return std::nullopt;
  return BaselineScale{1.0 / best.inverse, deviation, best.count};
}

}  // namespace bslam::estimators
