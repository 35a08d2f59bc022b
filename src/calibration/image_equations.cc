#include "calibration/image_equations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace bslam::calibration {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

constexpr double kMedianChi2SixDof = 5.348;
constexpr std::size_t kMinPairs = 4;          // of successive images
constexpr std::size_t kMinPairsOfCamera = 3;  // of successive images of a camera
// Correlation in the images of an unsteady camera, and its minimum ratio to that of the others. Images of real rigs
// with small errors of their times have up to 9, those of a focus that drifts by 1 % 25 or more.
constexpr double kUnsteady = 15, kUnsteadyRatio = 5;

// Adds an observation to the equations of its image.
void add(const solver::ReprojectionProblem& problem, const solver::RigValues& values,
         const solver::ReprojectionProblem::Observation& o, ImageEquations& sums) {
  const std::size_t c = o.camera.index();
  const Eigen::Vector3d point = solver::point_in_camera(problem, values, o, c);
  const auto residual = solver::residual(values.models[c], point, o.pixel.cast<double>());
  if (!residual) return;
  const double inverse_sigma = 1.0 / static_cast<double>(o.sigma);
  const Eigen::Vector2d e = inverse_sigma * residual->error;
  const double chi2 = e.squaredNorm();
  if (!(chi2 < kMaxUsedChi2)) return;
  const solver::Matrix62d Jt = solver::pose_jacobian_transposed(inverse_sigma * residual->J, point);
  const double weight = solver::huber_weight(chi2);
  sums.H += weight * Jt * Jt.transpose();
  sums.b += weight * Jt * e;
  sums.squared_errors += weight * chi2;
  ++sums.observations;
  if (sums.observations == kMinObservations) sums.keyframes = 1;
}

// What independent extrinsics of two successive images of a camera would gain, for all such images.
struct ChangesBetweenImages {
  std::vector<double> decreases;  // twice those of the cost
  ImageEquations sum;             // of all images

  // The median gain relative to that of independent errors of the same variance. `decreases` must not be empty.
  double correlation() const {
    const double variance = sum.squared_errors / (2.0 * sum.observations);
    return median(decreases) / (kMedianChi2SixDof * variance);
  }
};

ChangesBetweenImages changes_of(std::size_t camera, std::size_t cameras, const std::vector<std::size_t>& poses,
                                const std::vector<ImageEquations>& equations) {
  ChangesBetweenImages out;
  const ImageEquations* previous = nullptr;
  for (const std::size_t pose : poses) {
    const ImageEquations& image = equations[pose * cameras + camera];
    if (!image.enough()) continue;
    out.sum.add(image);
    if (previous != nullptr) {
      ImageEquations both = *previous;
      both.add(image);
      const double decrease = best_change(both, image).second;
      if (std::isfinite(decrease)) out.decreases.push_back(decrease);
    }
    previous = &image;
  }
  return out;
}

}  // namespace

void ImageEquations::add(const ImageEquations& other) {
  H += other.H;
  b += other.b;
  squared_errors += other.squared_errors;
  observations += other.observations;
  keyframes += other.keyframes;
}

std::vector<ImageEquations> image_equations(const RigProblem& problem, const solver::RigValues& values) {
  const solver::ReprojectionProblem& bundle = problem.selected.problem;
  const std::size_t cameras = values.T_cam_rig.size();
  std::vector<ImageEquations> out(bundle.T_rig_world.size() * cameras);
  for (const auto& o : bundle.observations)
    add(bundle, values, o, out[static_cast<std::size_t>(o.pose) * cameras + o.camera.index()]);
  return out;
}

std::pair<Vector6d, double> best_change(const ImageEquations& all, const ImageEquations& after) {
  const Eigen::LDLT<Matrix6d> factor(all.H);
  const Matrix6d information = after.H - after.H * factor.solve(after.H);
  const Vector6d b = after.b - after.H * factor.solve(all.b);
  const Vector6d change = information.ldlt().solve(b);
  return {change, b.dot(change)};
}

double correlation_in_images(const map::BundledMap& map, const RigProblem& problem, const solver::RigValues& values) {
  const std::vector<std::size_t> poses = poses_by_time(map, problem);
  const std::vector<ImageEquations> equations = image_equations(problem, values);
  const std::size_t cameras = values.T_cam_rig.size();
  ChangesBetweenImages all;
  for (std::size_t c = 0; c < cameras; ++c) {
    const ChangesBetweenImages changes = changes_of(c, cameras, poses, equations);
    all.decreases.insert(all.decreases.end(), changes.decreases.begin(), changes.decreases.end());
    all.sum.add(changes.sum);
  }
  if (all.decreases.size() < kMinPairs || !(all.sum.squared_errors > 0)) return 1;
  return std::max(1.0, all.correlation());
}

std::optional<std::size_t> unsteady_camera(const map::BundledMap& map, const RigProblem& problem,
                                           const solver::RigValues& values) {
  const std::vector<std::size_t> poses = poses_by_time(map, problem);
  const std::vector<ImageEquations> equations = image_equations(problem, values);
  const std::size_t cameras = values.T_cam_rig.size();
  std::vector<std::pair<std::size_t, double>> found;  // cameras and their correlations
  for (std::size_t c = 0; c < cameras; ++c) {
    const ChangesBetweenImages changes = changes_of(c, cameras, poses, equations);
    if (changes.decreases.size() >= kMinPairsOfCamera && changes.sum.squared_errors > 0)
      found.emplace_back(c, changes.correlation());
  }
  if (found.size() < 2) return std::nullopt;
  const auto most = std::ranges::max_element(found, {}, &std::pair<std::size_t, double>::second);
  std::vector<double> others;
  for (const auto& [camera, correlation] : found) {
    if (camera != most->first) others.push_back(correlation);
  }
  const double usual = lower_median(std::move(others));
  return most->second > std::max(kUnsteady, kUnsteadyRatio * usual) ? std::optional(most->first) : std::nullopt;
}

}  // namespace bslam::calibration
