#include "solver/similarity_ransac.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "base/assert.h"

namespace bslam::solver {
namespace {

using geometry::Matrix7d;
using geometry::ScaleMode;
using geometry::Sim3;
using geometry::Vector7d;
using Matrix37d = Eigen::Matrix<double, 3, 7>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMinSamples = 30;  // noise makes some samples without outliers poor ones

// H delta = b for the left perturbation of S_a_b, and the cost: the sum of kernel costs / 2.
struct Equations {
  Matrix7d H = Matrix7d::Zero();
  Vector7d b = Vector7d::Zero();
  double cost = 0.0;
};

struct SquaredErrors {
  double in_a, in_b;  // normalised; infinite where the point does not project
  bool within(double bound) const { return in_a <= bound && in_b <= bound; }
};

class SimilarityProblem {
 public:
  SimilarityProblem(const Rig& rig, std::span<const SimilarityMatch> matches, ScaleMode scale)
      : rig_(rig), matches_(matches), unknowns_(scale == ScaleMode::kFree ? 7 : 6), inlier_(matches.size(), 0) {}

  const std::vector<std::uint8_t>& inlier() const { return inlier_; }
  int num_inliers() const { return static_cast<int>(std::count(inlier_.begin(), inlier_.end(), 1)); }

  // Which matches are inliers at S_a_b: those within `bound` in both images. Returns how many changed.
  int select(const Sim3& S_a_b, double bound) {
    const Sim3 S_b_a = S_a_b.inverse();
    int changed = 0;
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const bool is = squared_errors(matches_[i], S_a_b, S_b_a).within(bound);
      changed += is != (inlier_[i] != 0);
      inlier_[i] = is;
    }
    return changed;
  }

  // Sum of min(squared error, bound) over all matches and both images (MSAC); stops early beyond `limit`.
  double truncated_cost(const Sim3& S_a_b, double bound, double limit) const {
    const Sim3 S_b_a = S_a_b.inverse();
    double cost = 0.0;
    for (std::size_t i = 0; i < matches_.size() && cost <= limit; ++i) {
      const SquaredErrors errors = squared_errors(matches_[i], S_a_b, S_b_a);
      cost += std::min(errors.in_a, bound) + std::min(errors.in_b, bound);
    }
    return cost;
  }

  // Levenberg-Marquardt over the inliers; undamped until a step fails.
  Sim3 minimise(const Sim3& start, int iterations) const {
    constexpr double kFirstDamping = 1e-3, kMaxDamping = 1e6, kTolerance = 1e-3;  // of the standard deviation
    Sim3 S = start;
    Equations equations = linearise(S, Kernel::kHuber);
    double damping = 0.0;
    for (int i = 0; i < iterations && damping < kMaxDamping; ++i) {
      const Vector7d delta = solve(equations, damping);
      if (!delta.allFinite()) break;
      const Sim3 trial = S.perturbed(delta);
      if (damping == 0.0 && delta.dot(equations.H * delta) < kTolerance * kTolerance) return trial;
      const Equations next = linearise(trial, Kernel::kHuber);
      if (next.cost <= equations.cost) {
        S = trial;
        equations = next;
        damping = damping > kFirstDamping ? 0.1 * damping : 0.0;
      } else {
        damping = std::max(kFirstDamping, 10.0 * damping);
      }
    }
    return S;
  }

  // Is every direction of the transform known to better than 0.05: radians, share of the distance to what is seen,
  // share of the scale?
  bool well_conditioned(const Sim3& S_a_b) const {
    constexpr double kMaxDeviation = 0.05;
    double inverse_distance = 0.0;
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      if (inlier_[i] != 0) inverse_distance += 1.0 / std::max(1e-3, matches_[i].point_a.norm());
    }
    Vector7d unit = Vector7d::Ones();
    unit.segment<3>(3).setConstant(num_inliers() / inverse_distance);
    const Matrix7d scaled = unit.asDiagonal() * linearise(S_a_b, Kernel::kNone).H * unit.asDiagonal();
    const Eigen::MatrixXd known = scaled.topLeftCorner(unknowns_, unknowns_);
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(known, Eigen::EigenvaluesOnly).eigenvalues()(0);
    return smallest * kMaxDeviation * kMaxDeviation > 1.0;
  }

 private:
  double squared_error(CameraIndex camera, const Vector3d& point_rig, const Vector2d& pixel, double sigma) const {
    const auto projection = rig_.camera(camera).project(rig_.cam_from_rig(camera) * point_rig);
    return projection ? (pixel - *projection).squaredNorm() / (sigma * sigma) : kInfinity;
  }

  SquaredErrors squared_errors(const SimilarityMatch& m, const Sim3& S_a_b, const Sim3& S_b_a) const {
    return {squared_error(m.camera_a, S_a_b * m.point_b, m.pixel_a, m.sigma_a),
            squared_error(m.camera_b, S_b_a * m.point_a, m.pixel_b, m.sigma_b)};
  }

  // One reprojection error, with J_point = d point_rig / d delta.
  void add(CameraIndex camera, const Vector3d& point_rig, const Matrix37d& J_point, const Vector2d& pixel, double sigma,
           Kernel kernel, Equations& out) const {
    const SE3& T_cam_rig = rig_.cam_from_rig(camera);
    const auto projection = rig_.camera(camera).project_with_jacobian(T_cam_rig * point_rig);
    const Vector2d e = projection ? Vector2d((pixel - projection->pixel) / sigma) : Vector2d::Zero();
    const double chi2 = projection ? e.squaredNorm() : kInfinity;
    out.cost += 0.5 * kernel_cost(kernel, std::min(chi2, kLostChi2));
    if (!(chi2 < kLostChi2)) return;
    const Eigen::Matrix<double, 2, 7> J = projection->jacobian / sigma * (T_cam_rig.matrix3() * J_point);
    const double weight = kernel_weight(kernel, chi2);
    out.H.noalias() += weight * J.transpose() * J;
    out.b.noalias() += weight * J.transpose() * e;
  }

  // docs/math.md, section 11.
  Equations linearise(const Sim3& S_a_b, Kernel kernel) const {
    const Sim3 S_b_a = S_a_b.inverse();
    const geometry::Matrix3d sR_b_a = S_b_a.scale() * S_b_a.rotation().toRotationMatrix();
    Equations out;
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      if (inlier_[i] == 0) continue;
      const SimilarityMatch& m = matches_[i];
      const Vector3d in_a = S_a_b * m.point_b;
      Matrix37d J_a, J_b;
      J_a << -geometry::skew(in_a), geometry::Matrix3d::Identity(), in_a;
      J_b << -geometry::skew(m.point_a), geometry::Matrix3d::Identity(), m.point_a;
      add(m.camera_a, in_a, J_a, m.pixel_a, m.sigma_a, kernel, out);
      add(m.camera_b, S_b_a * m.point_a, -sR_b_a * J_b, m.pixel_b, m.sigma_b, kernel, out);
    }
    return out;
  }

  Vector7d solve(const Equations& equations, double damping) const {
    constexpr double kRidge = 1e-9;  // of the largest on the diagonal
    Matrix7d damped = equations.H;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += kRidge * equations.H.diagonal().maxCoeff();
    Vector7d delta = Vector7d::Zero();
    if (unknowns_ == 7) {
      delta = damped.ldlt().solve(equations.b);
    } else {
      delta.head<6>() = damped.topLeftCorner<6, 6>().ldlt().solve(equations.b.head<6>());
    }
    return delta;
  }

  const Rig& rig_;
  std::span<const SimilarityMatch> matches_;
  int unknowns_;
  std::vector<std::uint8_t> inlier_;
};

// The transform of three different matches; empty where they do not determine it.
std::optional<Sim3> draw_hypothesis(std::span<const SimilarityMatch> matches, ScaleMode scale, Random& random) {
  constexpr double kMinScale = 1e-3, kMaxScale = 1e3;
  const auto n = static_cast<std::uint32_t>(matches.size());
  std::array<std::uint32_t, 3> index{};
  do {
    for (std::uint32_t& i : index) i = random.below(n);
  } while (index[0] == index[1] || index[0] == index[2] || index[1] == index[2]);
  std::array<Vector3d, 3> in_a, in_b;
  for (std::size_t k = 0; k < 3; ++k) {
    in_a[k] = matches[index[k]].point_a;
    in_b[k] = matches[index[k]].point_b;
  }
  const auto S = geometry::align_points(in_b, in_a, scale);
  if (!S || !(S->scale() > kMinScale && S->scale() < kMaxScale)) return std::nullopt;
  return S;
}

double samples_needed(double inlier_share, double confidence) {
  const double all_inliers = std::pow(inlier_share, 3);
  if (all_inliers >= 1.0) return 1.0;
  return std::log(1.0 - confidence) / std::log1p(-all_inliers);
}

// The best of the samples, each better one refined over what agrees with it; empty where none determines a transform.
std::optional<Sim3> best_sample(SimilarityProblem& problem, std::span<const SimilarityMatch> matches, ScaleMode scale,
                                const SimilarityRansacOptions& options, Random& random) {
  constexpr int kLocalSteps = 4;
  std::optional<Sim3> best;
  double best_cost = kInfinity, needed = options.iterations;
  for (int i = 0; i < options.iterations && i < std::max<double>(kMinSamples, needed); ++i) {
    const auto S = draw_hypothesis(matches, scale, random);
    if (!S) continue;
    const double cost = problem.truncated_cost(*S, options.sample_chi2, best_cost);
    if (!(cost < best_cost)) continue;
    best = S;
    best_cost = cost;
    problem.select(*S, options.sample_chi2);
    const Sim3 local = problem.minimise(*S, kLocalSteps);
    const double local_cost = problem.truncated_cost(local, options.sample_chi2, best_cost);
    if (local_cost < best_cost) {
      best = local;
      best_cost = local_cost;
    }
    problem.select(*best, options.sample_chi2);
    needed = samples_needed(problem.num_inliers() / static_cast<double>(matches.size()), options.confidence);
  }
  return best;
}

}  // namespace

std::optional<SimilarityEstimate> ransac_similarity(const Rig& rig, std::span<const SimilarityMatch> matches,
                                                    ScaleMode scale, const SimilarityRansacOptions& options,
                                                    Random random) {
  constexpr int kRounds = 5, kSteps = 10;
  for (const SimilarityMatch& m : matches) {
    BSLAM_ASSERT(m.sigma_a > 0 && m.sigma_b > 0, "a standard deviation is positive");
  }
  if (matches.size() < static_cast<std::size_t>(std::max(3, options.min_inliers))) return std::nullopt;
  SimilarityProblem problem(rig, matches, scale);
  const auto best = best_sample(problem, matches, scale, options, random);
  if (!best) return std::nullopt;
  Sim3 S_a_b = *best;
  problem.select(S_a_b, options.sample_chi2);
  for (int round = 0; round < kRounds; ++round) {
    S_a_b = problem.minimise(S_a_b, kSteps);
    if (problem.select(S_a_b, options.inlier_chi2) == 0) break;
  }
  const int count = problem.num_inliers();
  if (count < std::max(3, options.min_inliers) || !problem.well_conditioned(S_a_b)) return std::nullopt;
  return SimilarityEstimate{S_a_b, problem.inlier(), count};
}

}  // namespace bslam::solver
