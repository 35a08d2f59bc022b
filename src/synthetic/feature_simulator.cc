#include "synthetic/feature_simulator.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "geometry/triangulation.h"

namespace bslam::synthetic {
namespace {

feature::Descriptor random_descriptor(Random& random) {
  feature::Descriptor d;
  for (std::uint64_t& word : d) word = random.next();
  return d;
}

// Returns a smooth patch with gradients in both directions.
feature::Patch random_patch(Random& random) {
  constexpr int kCoarse = 4;
  std::array<double, kCoarse * kCoarse> node;
  for (double& n : node) n = random.uniform(40, 215);
  feature::Patch patch;
  for (int y = 0; y < feature::kPatchSize; ++y) {
    for (int x = 0; x < feature::kPatchSize; ++x) {
      const double step = (kCoarse - 1.0) / feature::kPatchSize;
      const int i = static_cast<int>(x * step), j = static_cast<int>(y * step);
      const double a = x * step - i, b = y * step - j;
      const auto at = [&](int column, int row) { return node[static_cast<std::size_t>(row * kCoarse + column)]; };
      const double value =
          (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
      patch[static_cast<std::size_t>(y * feature::kPatchSize + x)] = static_cast<std::uint8_t>(value);
    }
  }
  return patch;
}

// Returns a landmark near one of the six sides of the room, at most `scatter` inside; the sides are drawn in proportion
// to their areas.
SimulatedLandmark random_landmark(const FeatureSimulatorOptions& o, Random& random) {
  const Vector3d size = o.room_high - o.room_low;
  const std::array<double, 3> area = {size.y() * size.z(), size.x() * size.z(), size.x() * size.y()};
  double draw = random.uniform(0, area[0] + area[1] + area[2]);
  int axis = 0;
  while (axis < 2 && draw >= area[static_cast<std::size_t>(axis)]) draw -= area[static_cast<std::size_t>(axis++)];
  SimulatedLandmark l;
  for (int i = 0; i < 3; ++i) l.position[i] = random.uniform(o.room_low[i], o.room_high[i]);
  const double inside = random.uniform(0, o.scatter);
  l.position[axis] = random.uniform() < 0.5 ? o.room_low[axis] + inside : o.room_high[axis] - inside;
  const double turn = random.uniform(0, 2 * std::numbers::pi);
  l.tangent = Vector3d::Zero();
  l.tangent[(axis + 1) % 3] = std::cos(turn);
  l.tangent[(axis + 2) % 3] = std::sin(turn);
  l.base_distance = random.uniform(o.nearest_base, o.farthest_base);
  l.descriptor = random_descriptor(random);
  l.patch = random_patch(random);
  return l;
}

void add_keypoint(feature::Detections& k, const Vector2d& pixel, int level, double angle, double sigma,
                  const Vector3d& bearing, const feature::Descriptor& descriptor, const feature::Patch& patch) {
  k.pixel.push_back(pixel.cast<float>());
  k.level.push_back(static_cast<std::uint8_t>(level));
  k.angle.push_back(static_cast<float>(angle));
  k.sigma.push_back(static_cast<float>(sigma));
  k.bearing.push_back(bearing);
  k.descriptor.push_back(descriptor);
  k.patch.push_back(patch);
}

}  // namespace

FeatureSimulator::FeatureSimulator(camera::Rig rig, Trajectory trajectory, const FeatureSimulatorOptions& options)
    : rig_(std::move(rig)), trajectory_(std::move(trajectory)), options_(options) {
  Random random(options.scene_seed, "landmarks");
  landmarks_.reserve(static_cast<std::size_t>(options.landmarks));
  for (int i = 0; i < options.landmarks; ++i) landmarks_.push_back(random_landmark(options, random));
}

SimulatedFrame FeatureSimulator::frame(FrameId id, double time_s, std::span<const int> missing) const {
  SimulatedFrame out;
  out.T_world_body = trajectory_.T_world_body(time_s);
  out.T_world_rig = out.T_world_body * rig_.body_from_cam(0);
  out.frame.id = id;
  out.frame.time_ns = from_seconds(time_s);
  out.landmark.resize(rig_.size());
  for (std::size_t c = 0; c < rig_.size(); ++c) {
    frame::CameraFrame& camera_frame = out.frame.cameras.emplace_back();
    if (std::find(missing.begin(), missing.end(), static_cast<int>(c)) != missing.end()) continue;
    const double offset = c < options_.capture_offset_s.size() ? options_.capture_offset_s[c] : 0.0;
    camera_frame.state = image::ImageState::kPresent;
    camera_frame.time_ns = from_seconds(time_s + offset);
    Random random(options_.noise_seed, "observe", id.index() * rig_.size() + c);
    const geometry::SE3 T_world_cam = trajectory_.T_world_body(time_s + offset) * rig_.body_from_cam(c);
    feature::Detections detections;
    observe(c, T_world_cam, random, detections, out.landmark[c]);
    add_outliers(c, random, detections, out.landmark[c]);
    camera_frame.keypoints = std::move(detections);
    camera_frame.grid = frame::FeatureGrid(camera_frame.keypoints, rig_.camera(c).width, rig_.camera(c).height);
  }
  Random random(options_.noise_seed, "bundle", id.index());
  out.frame.bundled = bundle(out.frame.cameras, out.landmark, random);
  return out;
}

std::optional<FeatureSimulator::View> FeatureSimulator::view(std::size_t landmark, std::size_t camera,
                                                             const geometry::SE3& T_world_cam) const {
  const SimulatedLandmark& l = landmarks_[landmark];
  const geometry::SE3 T_cam_world = T_world_cam.inverse();
  const Vector3d point = T_cam_world * l.position;
  const auto levels = [&](double factor) {
    return static_cast<int>(std::lround(std::log(factor) / std::log(options_.scale_factor)));
  };
  const double finer = rig_.camera(0).radians_per_pixel() / rig_.camera(camera).radians_per_pixel();
  const int level = levels(l.base_distance / point.norm()) + levels(finer);
  if (level < 0 || level >= options_.levels) return std::nullopt;
  const auto projection = rig_.camera(camera).project_with_jacobian(point);
  constexpr double kMargin = 8.0;  // pixels; feature extractors ignore the border too
  if (!projection || !rig_.camera(camera).contains(projection->pixel, kMargin)) return std::nullopt;
  const Vector2d direction = projection->jacobian * (T_cam_world.rotation() * l.tangent);
  return View{projection->pixel, level, std::atan2(direction.y(), direction.x())};
}

void FeatureSimulator::observe(std::size_t camera, const geometry::SE3& T_world_cam, Random& random,
                               feature::Detections& keypoints, std::vector<int>& landmark) const {
  for (std::size_t i = 0; i < landmarks_.size() && keypoints.size() < static_cast<std::size_t>(options_.max_keypoints);
       ++i) {
    const auto seen = view(i, camera, T_world_cam);
    if (!seen || random.uniform() >= options_.detection_share) continue;
    const double sigma = options_.sigma_px * std::pow(options_.scale_factor, seen->level);
    const Vector2d noise{random.normal(), random.normal()};
    const Vector2d pixel = seen->pixel + sigma * noise;
    const auto bearing = rig_.camera(camera).unproject(pixel);
    if (!bearing || !rig_.camera(camera).contains(pixel)) continue;
    feature::Descriptor descriptor = landmarks_[i].descriptor;
    const int flips = static_cast<int>(options_.flipped_bits * random.uniform(0.5, 1.5) + 0.5);
    for (int k = 0; k < flips; ++k) {
      const std::uint32_t bit = random.below(256);
      descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    add_keypoint(keypoints, pixel, seen->level, seen->angle + 0.05 * random.normal(), sigma, *bearing, descriptor,
                 landmarks_[i].patch);
    landmark.push_back(static_cast<int>(i));
  }
}

void FeatureSimulator::add_outliers(std::size_t camera, Random& random, feature::Detections& keypoints,
                                    std::vector<int>& landmark) const {
  const camera::Camera& c = rig_.camera(camera);
  const auto count = static_cast<int>(std::lround(options_.outlier_share * static_cast<double>(keypoints.size())));
  for (int k = 0; k < count; ++k) {
    const Vector2d pixel{random.uniform(0, c.width - 1), random.uniform(0, c.height - 1)};
    const auto bearing = c.unproject(pixel);
    if (!bearing) continue;
    const int level = static_cast<int>(random.below(static_cast<std::uint32_t>(options_.levels)));
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double sigma = options_.sigma_px * std::pow(options_.scale_factor, level);
    const feature::Descriptor descriptor = random_descriptor(random);
    add_keypoint(keypoints, pixel, level, angle, sigma, *bearing, descriptor, random_patch(random));
    landmark.push_back(-1);
  }
}

frame::Bundled FeatureSimulator::bundle(const std::vector<frame::CameraFrame>& cameras,
                                        const std::vector<std::vector<int>>& landmark, Random& random) const {
  std::vector<std::vector<frame::KeypointRef>> by_landmark(landmarks_.size());
  std::vector<std::size_t> counts;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    counts.push_back(cameras[c].keypoints.size());
    for (std::size_t k = 0; k < landmark[c].size(); ++k) {
      if (landmark[c][k] >= 0)
        by_landmark[static_cast<std::size_t>(landmark[c][k])].push_back({CameraIndex(c), KeypointIndex(k)});
    }
  }
  std::vector<std::vector<frame::KeypointRef>> matched;
  std::vector<std::optional<frame::BundledPoint>> points;
  for (std::vector<frame::KeypointRef>& group : by_landmark) {
    if (group.size() < 2 || random.uniform() >= options_.matched_share) continue;
    points.push_back(triangulate(cameras, group));
    matched.push_back(std::move(group));
  }
  return frame::Bundled(counts, matched, points);
}

std::optional<frame::BundledPoint> FeatureSimulator::triangulate(const std::vector<frame::CameraFrame>& cameras,
                                                                 const std::vector<frame::KeypointRef>& group) const {
  std::vector<geometry::Ray> rays;
  for (const frame::KeypointRef& ref : group) {
    const geometry::SE3& T_rig_cam = rig_.rig_from_cam(ref.camera.index());
    const Vector3d& bearing = cameras[ref.camera.index()].keypoints.bearing[ref.keypoint.index()];
    rays.push_back({T_rig_cam.translation(), T_rig_cam.rotation() * bearing});
  }
  const auto point = geometry::triangulate_midpoint(rays, FeatureSimulatorOptions::kMinAngle);
  if (!point) return std::nullopt;
  // first-order information matrix of the point, from the pixels
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const frame::KeypointRef& ref : group) {
    const geometry::SE3& T_cam_rig = rig_.cam_from_rig(ref.camera);
    const auto projection = rig_.camera(ref.camera).project_with_jacobian(T_cam_rig * *point);
    if (!projection) return std::nullopt;
    const camera::Matrix23d J = projection->jacobian * T_cam_rig.matrix3();
    const double sigma = cameras[ref.camera.index()].keypoints.sigma[ref.keypoint.index()];
    information += J.transpose() * J / (sigma * sigma);
  }
  const Eigen::Matrix3d covariance = information.inverse();
  if (!covariance.allFinite()) return std::nullopt;
  return frame::BundledPoint{*point, 0.5 * (covariance + covariance.transpose())};
}

}  // namespace bslam::synthetic
