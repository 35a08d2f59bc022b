#include "tracking/feature_budget.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/reprojection.h"

namespace bslam::tracking {
namespace {

using geometry::Matrix6d;

constexpr double kEvenFraction = 0.5;  // fraction of the budget that is divided equally
constexpr double kRate = 0.1;          // weight of a new frame; a single frame contains little information
constexpr double kMinFraction = 1e-6;  // avoids divisions by zero if all fractions are zero

double fraction_of(std::span<const double> fractions, std::size_t camera) {
  return fractions.empty() ? 1.0 : std::max(fractions[camera], kMinFraction);
}

double sum_of(std::span<const double> values) { return std::accumulate(values.begin(), values.end(), 0.0); }

// tr(I^-1 I_c) / 6 per camera; empty if some direction of the pose is not observed.
std::vector<double> design_fractions(std::span<const Matrix6d> information) {
  Matrix6d all = Matrix6d::Zero();
  for (const Matrix6d& i : information) all += i;
  const Eigen::LLT<Matrix6d> factor(all);
  if (factor.info() != Eigen::Success) return {};
  std::vector<double> fractions;
  for (const Matrix6d& i : information) fractions.push_back(std::max(0.0, factor.solve(i).trace() / 6.0));
  return std::isfinite(sum_of(fractions)) && sum_of(fractions) > 0 ? fractions : std::vector<double>{};
}

}  // namespace

std::vector<Matrix6d> information_by_camera(const map::BundledMap& map, const frame::BundledFrame& frame,
                                            const FrameMatches& matches, const geometry::SE3& T_rig_world) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<Matrix6d> information(rig.size(), Matrix6d::Zero());
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    for (const Match& m : matches[c]) {
      const std::size_t k = m.keypoint.index();
      const auto residual = solver::ReprojectionResidual::evaluate(
          rig, CameraIndex(c), T_rig_world, map.landmark(m.landmark).position, keypoints.pixel[k].cast<double>());
      if (!residual) continue;
      const double weight = 1.0 / (keypoints.sigma[k] * keypoints.sigma[k]);
      information[c].noalias() += weight * residual->J_pose.transpose() * residual->J_pose;
    }
  }
  return information;
}

std::vector<double> budget_fractions(std::span<const double> before, std::span<const Matrix6d> information,
                                     std::span<const std::uint8_t> has_image) {
  const std::size_t n = has_image.size();
  std::vector<double> fractions(before.begin(), before.end());
  if (fractions.empty()) fractions.assign(n, 1.0 / static_cast<double>(n));
  const std::vector<double> wanted = design_fractions(information);
  double divisible = 0;  // sum of the fractions of the cameras with an image
  std::size_t num_with_image = 0;
  for (std::size_t c = 0; c < n; ++c) {
    divisible += has_image[c] ? fractions[c] : 0.0;
    num_with_image += has_image[c] != 0;
  }
  for (std::size_t c = 0; c < n; ++c) {
    if (!has_image[c]) continue;
    const double goal = wanted.empty() ? 1.0 / static_cast<double>(num_with_image) : wanted[c];
    fractions[c] += kRate * (divisible * goal - fractions[c]);
  }
  return fractions;
}

std::vector<double> budget_fractions(std::span<const double> before, const map::BundledMap& map,
                                     const frame::BundledFrame& frame, const TrackOutput& output) {
  const bool tracking = output.result.status == TrackStatus::kTracking;
  std::vector<std::uint8_t> has_image;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {  // an excluded camera was removed from the frame
    has_image.push_back(frame.cameras[c].state == image::ImageState::kPresent ||
                        (tracking && output.result.cameras[c].excluded));
  }
  if (!tracking) return budget_fractions(before, {}, has_image);
  return budget_fractions(before, information_by_camera(map, frame, output.matches, output.result.T_rig_world),
                          has_image);
}

std::vector<int> feature_budgets(std::size_t cameras, std::span<const double> fractions,
                                 std::span<const std::uint8_t> skipped, std::span<const std::uint8_t> failing,
                                 const feature::FeatureOptions& options) {
  std::vector<std::size_t> open;  // cameras below their maximum
  for (std::size_t c = 0; c < cameras; ++c) {
    if (skipped.empty() || !skipped[c]) open.push_back(c);
  }
  std::vector<int> budgets(cameras, 0);
  if (open.empty()) return budgets;
  const auto n = static_cast<double>(open.size()), per_image = static_cast<double>(options.per_image);
  const double of_all = static_cast<double>(cameras) * per_image;
  const double of_rig = options.per_rig > 0 ? std::min(static_cast<double>(options.per_rig), of_all) : of_all;
  const auto num_working =
      static_cast<double>(cameras) - static_cast<double>(std::ranges::count(failing, std::uint8_t{1}));
  const double even = of_rig / std::max(1.0, num_working);
  const double max_budget = std::clamp(even, per_image, feature::FeatureOptions::kMaxFactorIfOthersFail * per_image);
  const double total = std::min(n * max_budget, of_rig);
  const double min_budget = kEvenFraction * total / n;
  double left = total - n * min_budget;  // divided in proportion to the fractions
  // Each round assigns the maximum to the cameras that would exceed it. It is the last one if there are none.
  while (!open.empty()) {
    double weight = 0;
    for (const std::size_t c : open) weight += fraction_of(fractions, c);
    const auto wanted = [&](std::size_t c) { return min_budget + left * fraction_of(fractions, c) / weight; };
    const auto filled =
        std::stable_partition(open.begin(), open.end(), [&](std::size_t c) { return wanted(c) < max_budget; });
    if (filled == open.end()) {
      for (const std::size_t c : open) budgets[c] = static_cast<int>(std::lround(wanted(c)));
      break;
    }
    left -= static_cast<double>(open.end() - filled) * (max_budget - min_budget);
    for (auto c = filled; c != open.end(); ++c) budgets[*c] = static_cast<int>(std::lround(max_budget));
    open.erase(filled, open.end());
  }
  return budgets;
}

}  // namespace bslam::tracking
