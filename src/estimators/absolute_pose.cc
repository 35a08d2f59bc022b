#include "estimators/absolute_pose.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>

#include "estimators/pose_ransac.h"
#include "geometry/alignment.h"
#include "solver/pose_problem.h"

namespace bslam::estimators {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMinSamples = 30;  // because of noise, some samples without outliers give poor poses
constexpr int kRedraws = 10;     // attempts to draw a sample of three different points

// An observation as a ray in the rig frame.
struct Ray {
  Vector3d origin, direction;  // metres; unit
  Vector3d point_world;
};
using Sample = std::array<const Ray*, 3>;

std::vector<Ray> rays_of(const Rig& rig, std::span<const solver::PoseObservation> observations) {
  std::vector<Ray> out;
  out.reserve(observations.size());
  for (const solver::PoseObservation& o : observations) {
    const auto bearing = rig.camera(o.camera).unproject(o.pixel);
    const SE3& T_rig_cam = rig.rig_from_cam(o.camera.index());
    if (bearing) out.push_back({T_rig_cam.translation(), T_rig_cam.rotation() * *bearing, o.point_world});
  }
  return out;
}

bool distinct_points(const Sample& s) {
  return s[0]->point_world != s[1]->point_world && s[0]->point_world != s[2]->point_world &&
         s[1]->point_world != s[2]->point_world;
}

// Three different rays, preferably of different points, because two views of one point contain less information.
Sample draw(std::span<const Ray> rays, Random& random) {
  const auto n = static_cast<std::uint32_t>(rays.size());
  Sample sample{};
  for (int attempt = 0; attempt < kRedraws; ++attempt) {
    const std::array<std::uint32_t, 3> index = random.three_below(n);
    for (std::size_t k = 0; k < 3; ++k) sample[k] = &rays[index[k]];
    if (distinct_points(sample)) break;
  }
  return sample;
}

// Newton's method for the distances along the three rays at which the points have the same mutual distances as the
// points in the world (docs/math.md, section 10), starting from the distances for a central rig. Returns false if it
// does not converge to positive distances.
bool solve_distances(const Sample& sample, Vector3d& along) {
  constexpr int kSteps = 8;
  constexpr double kSolved = 1e-9;  // relative tolerance of the squared distances
  for (int step = 0; step <= kSteps; ++step) {
    Vector3d error;
    Matrix3d J = Matrix3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3;
      const Ray &x = *sample[static_cast<std::size_t>(k)], &y = *sample[static_cast<std::size_t>(l)];
      const Vector3d between = x.origin + along(k) * x.direction - y.origin - along(l) * y.direction;
      const double squared = (x.point_world - y.point_world).squaredNorm();
      error(k) = between.squaredNorm() / squared - 1.0;
      J(k, k) = 2.0 * between.dot(x.direction) / squared;
      J(k, l) = -2.0 * between.dot(y.direction) / squared;
    }
    if (!error.allFinite()) return false;
    if (error.cwiseAbs().maxCoeff() < kSolved) return along.minCoeff() > 0.0;
    along -= J.inverse() * error;
  }
  return false;
}

// Up to four poses of the rig for which the sample's points lie on its rays.
void solve_sample(const Sample& sample, std::vector<SE3>& T_rig_world) {
  T_rig_world.clear();
  opengv::bearingVectors_t bearings;
  opengv::points_t points;
  for (const Ray* ray : sample) {
    bearings.push_back(ray->direction);
    points.push_back(ray->point_world);
  }
  const opengv::absolute_pose::CentralAbsoluteAdapter adapter(bearings, points);
  for (const auto& T :
       opengv::absolute_pose::p3p_kneip(adapter)) {  // T_world_rig of a central rig; roots may be complex
    if (!T.allFinite()) continue;
    Vector3d along;
    for (int k = 0; k < 3; ++k) {
      const Ray& ray = *sample[static_cast<std::size_t>(k)];
      along(k) = (ray.point_world - T.col(3)).dot(T.leftCols<3>() * ray.direction);
    }
    if (along.minCoeff() <= 0.0 || !solve_distances(sample, along)) continue;
    std::array<Vector3d, 3> in_world, in_rig;
    for (std::size_t k = 0; k < 3; ++k) {
      in_world[k] = sample[k]->point_world;
      in_rig[k] = sample[k]->origin + along(static_cast<int>(k)) * sample[k]->direction;
    }
    const auto S = geometry::align_points(in_world, in_rig, geometry::ScaleMode::kFixed);
    if (S) T_rig_world.emplace_back(S->rotation(), S->translation());
  }
}

int count_distinct_points(std::span<const solver::PoseObservation> observations,
                          const std::vector<std::uint8_t>& inlier) {
  std::vector<std::array<double, 3>> points;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Vector3d& p = observations[i].point_world;
    if (inlier[i] != 0) points.push_back({p.x(), p.y(), p.z()});
  }
  std::sort(points.begin(), points.end());
  return static_cast<int>(std::unique(points.begin(), points.end()) - points.begin());
}

}  // namespace

solver::PoseSolution absolute_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                   const solver::PoseSolverOptions& options, const AbsolutePoseOptions& ransac,
                                   Random random) {
  const std::vector<Ray> rays = rays_of(rig, observations);
  solver::PoseProblem problem(rig, observations);
  PoseSearch search(problem, ransac.inlier_chi2);
  std::vector<SE3> candidates;
  double needed = ransac.iterations;
  for (int i = 0; rays.size() >= 3 && i < ransac.iterations && i < std::max<double>(kMinSamples, needed); ++i) {
    solve_sample(draw(rays, random), candidates);
    bool better = false;
    for (const SE3& T : candidates) better |= search.offer(T);
    if (better) needed = samples_needed(search.inlier_ratio(), ransac.confidence);
  }
  solver::PoseSolution out = solver::solve_rounds(problem, search.best(), ransac.inlier_chi2, options);
  out.ok &= count_distinct_points(observations, out.inlier) >= ransac.min_inliers;
  return out;
}

}  // namespace bslam::estimators
