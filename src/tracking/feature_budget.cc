#include "tracking/feature_budget.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/reprojection.h"

namespace bslam::tracking {
namespace {

using geometry::Matrix6d;

constexpr double kEvenPart = 0.5;     // of the budget: the rest goes by shares
constexpr double kFollow = 0.1;       // of the way to what the last frame says: ten frames, as one alone says little
constexpr double kLeastShare = 1e-6;  // keeps divisions finite where cameras tell nothing

double share_of(std::span<const double> shares, std::size_t camera) {
  return shares.empty() ? 1.0 : std::max(shares[camera], kLeastShare);
}

double sum_of(std::span<const double> values) { return std::accumulate(values.begin(), values.end(), 0.0); }

// tr(I^-1 I_c) / 6, or empty where some direction is not seen at all.
std::vector<double> design_shares(std::span<const Matrix6d> information) {
  Matrix6d all = Matrix6d::Zero();
  for (const Matrix6d& i : information) all += i;
  const Eigen::LLT<Matrix6d> factor(all);
  if (factor.info() != Eigen::Success) return {};
  std::vector<double> shares;
  for (const Matrix6d& i : information) shares.push_back(std::max(0.0, factor.solve(i).trace() / 6.0));
  return std::isfinite(sum_of(shares)) && sum_of(shares) > 0 ? shares : std::vector<double>{};
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

std::vector<double> feature_shares(std::span<const double> before, std::span<const Matrix6d> information,
                                   std::span<const std::uint8_t> seeing) {
  const std::size_t n = seeing.size();
  std::vector<double> shares(before.begin(), before.end());
  if (shares.empty()) shares.assign(n, 1.0 / static_cast<double>(n));
  const std::vector<double> wanted = design_shares(information);
  double to_share = 0;  // of the cameras with an image
  std::size_t num_seeing = 0;
  for (std::size_t c = 0; c < n; ++c) {
    to_share += seeing[c] ? shares[c] : 0.0;
    num_seeing += seeing[c] != 0;
  }
  for (std::size_t c = 0; c < n; ++c) {
    if (!seeing[c]) continue;
    const double goal = wanted.empty() ? 1.0 / static_cast<double>(num_seeing) : wanted[c];
    shares[c] += kFollow * (to_share * goal - shares[c]);
  }
  return shares;
}

std::vector<double> feature_shares(std::span<const double> before, const map::BundledMap& map,
                                   const frame::BundledFrame& frame, const TrackOutput& output) {
  const bool tracking = output.result.status == TrackStatus::kTracking;
  std::vector<std::uint8_t> seeing;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {  // a doubted camera was taken out of the frame
    seeing.push_back(frame.cameras[c].state == image::ImageState::kPresent ||
                     (tracking && output.result.cameras[c].doubted));
  }
  if (!tracking) return feature_shares(before, {}, seeing);
  return feature_shares(before, information_by_camera(map, frame, output.matches, output.result.T_rig_world), seeing);
}

std::vector<int> feature_budgets(std::size_t cameras, std::span<const double> shares,
                                 std::span<const std::uint8_t> left_out, std::span<const std::uint8_t> failing,
                                 const feature::FeatureOptions& options) {
  std::vector<std::size_t> open;  // cameras that can take more
  for (std::size_t c = 0; c < cameras; ++c) {
    if (left_out.empty() || !left_out[c]) open.push_back(c);
  }
  std::vector<int> budgets(cameras, 0);
  if (open.empty()) return budgets;
  const auto n = static_cast<double>(open.size()), per_image = static_cast<double>(options.per_image);
  const double of_all = static_cast<double>(cameras) * per_image;
  const double of_rig = options.per_rig > 0 ? std::min(static_cast<double>(options.per_rig), of_all) : of_all;
  const auto sound = static_cast<double>(cameras) - static_cast<double>(std::ranges::count(failing, std::uint8_t{1}));
  const double even = of_rig / std::max(1.0, sound);
  const double most = std::clamp(even, per_image, feature::FeatureOptions::kInForOthers * per_image);
  const double total = std::min(n * most, of_rig);
  const double least = kEvenPart * total / n;
  double left = total - n * least;  // beyond the least
  // Each round fills the cameras that would get more than they can take, and is the last where there is none.
  while (!open.empty()) {
    double weight = 0;
    for (const std::size_t c : open) weight += share_of(shares, c);
    const auto wanted = [&](std::size_t c) { return least + left * share_of(shares, c) / weight; };
    const auto filled =
        std::stable_partition(open.begin(), open.end(), [&](std::size_t c) { return wanted(c) < most; });
    if (filled == open.end()) {
      for (const std::size_t c : open) budgets[c] = static_cast<int>(std::lround(wanted(c)));
      break;
    }
    left -= static_cast<double>(open.end() - filled) * (most - least);
    for (auto c = filled; c != open.end(); ++c) budgets[*c] = static_cast<int>(std::lround(most));
    open.erase(filled, open.end());
  }
  return budgets;
}

}  // namespace bslam::tracking
