// Seeded scenes for the solver tests and benchmarks: rigs of any cameras, a path of poses, points in all directions.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "base/random.h"
#include "solver/bundle_adjuster.h"
#include "solver/pose_solver.h"

namespace bslam::solver::scene {

using geometry::Vector6d;

enum class Models { kPinhole, kRadTan, kFisheye, kSpheres, kMixed };

inline camera::CameraModel make_model(Models models, std::size_t i) {
  if (models == Models::kMixed) models = std::array{Models::kRadTan, Models::kFisheye, Models::kPinhole}[i % 3];
  const double step = static_cast<double>(i);  // all cameras differ
  if (models == Models::kPinhole) return camera::Pinhole({420 + step, 422, 376, 240 + step});
  if (models == Models::kRadTan) return camera::PinholeRadTan({458 + step, 457, 367, 248}, {-0.28, 0.074, 2e-4, 2e-5});
  const camera::Intrinsics wide{220 + step, 221, 374, 238};
  if (models == Models::kFisheye) return camera::KannalaBrandt(wide, {0.01, -0.004, 0.002, -0.0005});
  if (i % 3 == 0) return camera::Unified(wide, 0.6);
  if (i % 3 == 1) return camera::ExtendedUnified(wide, 0.57, 1.1);
  return camera::DoubleSphere(wide, -0.2, 0.58);
}

// Up to two cameras look ahead with a baseline of 0.2 m; more cameras look outwards, 0.2 m from the centre.
inline Rig make_rig(std::size_t cameras, Models models) {
  std::vector<camera::RigCamera> out;
  for (std::size_t i = 0; i < cameras; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(cameras);
    const double yaw = cameras <= 2 ? 0.03 * static_cast<double>(i) : 2 * std::numbers::pi * share;
    const geometry::Quaterniond R(
        Eigen::AngleAxisd(yaw, Vector3d::UnitY()) *
        Eigen::AngleAxisd(0.05 * static_cast<double>(i), Vector3d(0.4, 0.1, 0.9).normalized()));
    const Vector3d t = cameras <= 2 ? Vector3d(0.2 * static_cast<double>(i), 0, 0)
                                    : Vector3d(0.2 * std::sin(yaw), 0.02 * static_cast<double>(i), 0.2 * std::cos(yaw));
    out.push_back({camera::Camera{"cam" + std::to_string(i), make_model(models, i), 752, 480, 0, ""}, SE3(R, t)});
  }
  return Rig(std::move(out));
}

// The rig with rolling shutters of all cameras.
inline Rig with_readout(const Rig& rig, double readout_s) {
  std::vector<camera::RigCamera> out;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    out.push_back({rig.camera(i), rig.body_from_cam(i)});
    out.back().camera.readout_s = readout_s;
  }
  return Rig(std::move(out));
}

// The components of random vectors are drawn by separate statements, because compilers differ in the order in which
// they evaluate the arguments of a function, and the test data must not depend on the compiler.
inline Vector3d random_direction(Random& random) {
  Vector3d v;
  do {
    for (int i = 2; i >= 0; --i) v[i] = random.uniform(-1, 1);
  } while (v.squaredNorm() > 1 || v.squaredNorm() < 1e-4);
  return v.normalized();
}

inline Vector6d random_twist(Random& random, double angle, double distance) {
  Vector6d xi;
  xi << angle * random_direction(random), distance * random_direction(random);
  return xi;
}

// Pixel of the point, or nullopt if it is outside the image.
inline std::optional<Vector2d> see(const Rig& rig, std::size_t i, const SE3& T_rig_world, const Vector3d& point_world) {
  const auto pixel = camera::project(rig.camera(i), rig.shutter(i), rig.cam_from_rig(i) * (T_rig_world * point_world));
  if (!pixel || !rig.camera(i).contains(*pixel)) return std::nullopt;
  return pixel;
}

// Noise of a pixel with a standard deviation of 1 px per axis.
inline Vector2d random_noise(Random& random) {
  const double y = random.normal(), x = random.normal();
  return {x, y};
}

inline Vector2d random_pixel(const camera::Camera& camera, Random& random) {
  const double y = random.uniform(0, camera.height - 1), x = random.uniform(0, camera.width - 1);
  return {x, y};
}

// A point visible in some camera of the rig, at least 2 m away, uniform in inverse distance.
inline Vector3d random_visible_point(const Rig& rig, const SE3& T_rig_world, Random& random, double farthest = 30) {
  const std::size_t i = random.below(static_cast<std::uint32_t>(rig.size()));
  for (;;) {
    const auto bearing = rig.camera(i).unproject(random_pixel(rig.camera(i), random));
    if (!bearing) continue;
    return T_rig_world.inverse() * (rig.rig_from_cam(i) * (*bearing / random.uniform(1.0 / farthest, 1.0 / 2)));
  }
}

struct PoseScene {
  SE3 T_rig_world;  // truth
  std::vector<PoseObservation> observations;
  std::vector<std::uint8_t> outlier;
};

// `count` observations in random order of cameras; of them `outlier_ratio` anywhere in the image; sigma 1 or 1.2 px.
inline PoseScene make_pose_scene(const Rig& rig, int count, double noise, double outlier_ratio, Random& random) {
  PoseScene out;
  out.T_rig_world = SE3::exp(random_twist(random, 0.8, 5.0));
  while (static_cast<int>(out.observations.size()) < count) {
    const Vector3d point = random_visible_point(rig, out.T_rig_world, random);
    for (std::size_t i = 0; i < rig.size() && static_cast<int>(out.observations.size()) < count; ++i) {
      const auto pixel = see(rig, i, out.T_rig_world, point);
      if (!pixel) continue;
      const bool outlier = random.uniform() < outlier_ratio;
      const double sigma = random.below(2) == 0 ? 1.0 : 1.2;
      Vector2d seen = *pixel + noise * sigma * random_noise(random);
      while (outlier && (seen - *pixel).norm() < 20) {
        seen = {random.uniform(0, rig.camera(i).width), random.uniform(0, rig.camera(i).height)};
      }
      out.observations.push_back({CameraIndex(i), point, seen, sigma});
      out.outlier.push_back(outlier);
    }
  }
  return out;
}

struct BundleSpec {
  std::size_t cameras = 4;
  Models models = Models::kMixed;
  int fixed_poses = 2, free_poses = 6;  // the fixed ones come first
  int points = 200;
  int poses_per_point = 6;                  // maximum number of consecutive poses
  int max_observations = 1 << 30;           // of one point
  double farthest = 30;                     // metres
  double noise = 1.0, outlier_ratio = 0.0;  // outliers have errors of about 15 px
  double pose_angle = 0.01, pose_distance = 0.05,
         point_distance = 0.1;  // errors of the initial values: radians, metres
};

struct BundleScene {
  Rig rig;
  ReprojectionProblem problem;   // its rig points to `rig`: do not move the scene
  std::vector<SE3> T_rig_world;  // truth
  std::vector<Vector3d> points;
};

// A path with steps of 0.25 m; every point is seen from consecutive poses around one of them.
inline std::unique_ptr<BundleScene> make_bundle_scene(const BundleSpec& spec, Random& random) {
  auto out = std::make_unique<BundleScene>(BundleScene{make_rig(spec.cameras, spec.models), {}, {}, {}});
  const int num_poses = spec.fixed_poses + spec.free_poses;
  out->problem.rig = &out->rig;
  for (int k = 0; k < num_poses; ++k) {
    const double s = 0.25 * k;
    Vector6d xi;
    xi << 0.1 * std::sin(s), 0.2 * std::sin(0.3 * s), 0.05 * std::cos(s), 0, 0, 0;
    const SE3 T_world_rig(SE3::exp(xi).rotation(), Vector3d(0.6 * s, 0.2 * std::sin(s), 0.8 * s));
    out->T_rig_world.push_back(T_world_rig.inverse());
    const bool free = k >= spec.fixed_poses;
    out->problem.pose_free.push_back(free);
    out->problem.T_rig_world.push_back(
        free ? out->T_rig_world.back().perturbed(random_twist(random, spec.pose_angle, spec.pose_distance))
             : out->T_rig_world.back());
  }
  for (int p = 0; p < spec.points; ++p) {
    const auto at = static_cast<int>(random.below(static_cast<std::uint32_t>(num_poses)));
    const int first = std::max(0, std::min(at - spec.poses_per_point / 2, num_poses - spec.poses_per_point));
    const Vector3d point =
        random_visible_point(out->rig, out->T_rig_world[static_cast<std::size_t>(at)], random, spec.farthest);
    out->points.push_back(point);
    out->problem.points.push_back(point + spec.point_distance * random_direction(random));
    int left = spec.max_observations;
    for (int k = first; k < std::min(num_poses, first + spec.poses_per_point); ++k) {
      for (std::size_t i = 0; i < out->rig.size() && left > 0; ++i) {
        auto pixel = see(out->rig, i, out->T_rig_world[static_cast<std::size_t>(k)], point);
        if (!pixel) continue;
        *pixel += spec.noise * random_noise(random);
        if (random.uniform() < spec.outlier_ratio) *pixel += 12 * random_noise(random);
        out->problem.observations.push_back({k, p, CameraIndex(i), pixel->cast<float>(), 1.0f});
        --left;
      }
    }
  }
  return out;
}

inline double rotation_error(const SE3& a, const SE3& b) { return a.rotation().angularDistance(b.rotation()); }
inline double centre_error(const SE3& a, const SE3& b) {
  return (a.inverse().translation() - b.inverse().translation()).norm();
}

}  // namespace bslam::solver::scene
