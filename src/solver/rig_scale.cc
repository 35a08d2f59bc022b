#include "solver/rig_scale.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "solver/bundle_structure.h"

namespace bslam::solver {
namespace {

using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::Vector6d;
using Matrix63d = Eigen::Matrix<double, 6, 3>;

constexpr double kPointDamping = 1e-12;  // share of the diagonal: points without parallax stay where they are
constexpr double kPoseDamping = 1e-10;
constexpr double kMinInformation = 1e-9;  // of what the lever arms alone would tell were poses and points known

struct Pose {
  Matrix3d R;
  Vector3d t;
};

// Sums over the terms of one point in one pose: with p the point in the rig frame and l the length of the extrinsics,
// A = de/dp and k = de/dl of the residual e, everything over sigma and times the kernel's weight.
struct GroupSums {
  Matrix3d M = Matrix3d::Zero();  // A^T A
  Vector3d m = Vector3d::Zero();  // A^T e
  Vector3d n = Vector3d::Zero();  // A^T k
};

// Normal equations of poses and length, points eliminated.
struct Equations {
  explicit Equations(std::size_t slots)
      : S(Eigen::MatrixXd::Zero(6 * static_cast<Eigen::Index>(slots), 6 * static_cast<Eigen::Index>(slots))),
        r(Eigen::VectorXd::Zero(S.rows())),
        h(Eigen::VectorXd::Zero(S.rows())) {}
  Eigen::MatrixXd S;       // poses; lower triangle
  Eigen::VectorXd r, h;    // right-hand side; coupling of poses and length
  double ll = 0, lb = 0;   // the length's own
  double lever = 0;        // its information were all else known
  double chi2 = 0;         // weighted, over ...
  double terms = 0;
};

class Assembly {
 public:
  Assembly(const ReprojectionProblem& problem, const BundleStructure& structure)
      : problem_(problem), structure_(structure), equations_(structure.pose_of_slot.size()) {
    for (const SE3& T : problem.T_rig_world) poses_.push_back({T.matrix3(), T.translation()});
  }

  Equations run() && {
    for (std::size_t i = 0; i < structure_.num_points(); ++i) add_point(i);
    return std::move(equations_);
  }

 private:
  struct FreeGroup {
    int slot;
    Matrix63d W, U;  // coupling of pose and point; W L^-T
  };

  GroupSums sum_group(std::size_t group, const Vector3d& point_rig);
  void add_point(std::size_t point);

  const ReprojectionProblem& problem_;
  const BundleStructure& structure_;
  Equations equations_;
  std::vector<Pose> poses_;
  std::vector<FreeGroup> free_;
};

GroupSums Assembly::sum_group(std::size_t group, const Vector3d& point_rig) {
  GroupSums out;
  const auto pose = static_cast<std::size_t>(structure_.groups[group].pose);
  for (std::size_t i = structure_.groups[group].first_term; i < structure_.groups[group + 1].first_term; ++i) {
    const BundleStructure::Term& term = structure_.terms[i];
    const CameraIndex camera(static_cast<std::size_t>(term.camera));
    const SE3 T_cam_rig = cam_from_rig_at(problem_, pose, camera);
    const auto projection = problem_.rig->camera(camera).project_with_jacobian(T_cam_rig * point_rig);
    if (!projection) continue;
    const Vector2d e = term.inverse_sigma * (term.pixel.cast<double>() - projection->pixel);
    const double chi2 = e.squaredNorm();
    if (!(chi2 < kLostChi2)) continue;
    const double weight = kernel_weight(Kernel::kHuber, chi2);
    const Matrix23d J = term.inverse_sigma * projection->jacobian;
    const Matrix23d A = J * T_cam_rig.matrix3();
    const Vector2d k = J * problem_.rig->cam_from_rig(camera).translation();
    out.M += weight * A.transpose() * A;
    out.m += weight * A.transpose() * e;
    out.n += weight * A.transpose() * k;
    equations_.ll += weight * k.squaredNorm();
    equations_.lb += weight * k.dot(e);
    equations_.lever += weight * k.squaredNorm();
    equations_.chi2 += weight * chi2;
    equations_.terms += weight;
  }
  return out;
}

// Adds the terms of one point and eliminates it. A pose moves by G = [-[p]x  I] of its perturbation, rotation first.
void Assembly::add_point(std::size_t point) {
  const Vector3d& P = problem_.points[static_cast<std::size_t>(structure_.points[point].point)];
  Matrix3d V = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero(), c = Vector3d::Zero();
  free_.clear();
  for (std::size_t g = structure_.points[point].first_group; g < structure_.points[point + 1].first_group; ++g) {
    const Pose& pose = poses_[static_cast<std::size_t>(structure_.groups[g].pose)];
    const Vector3d point_rig = pose.R * P + pose.t;
    const GroupSums sums = sum_group(g, point_rig);
    V += pose.R.transpose() * sums.M * pose.R;
    b += pose.R.transpose() * sums.m;
    c += pose.R.transpose() * sums.n;
    const int slot = structure_.groups[g].slot;
    if (slot < 0) continue;
    Eigen::Matrix<double, 3, 6> G;
    G << -geometry::skew(point_rig), Matrix3d::Identity();
    const Matrix63d GM = G.transpose() * sums.M;
    equations_.S.block<6, 6>(6 * slot, 6 * slot) += GM * G;
    equations_.r.segment<6>(6 * slot) += G.transpose() * sums.m;
    equations_.h.segment<6>(6 * slot) += G.transpose() * sums.n;
    free_.push_back({slot, GM * pose.R, Matrix63d::Zero()});
  }
  V.diagonal() *= 1.0 + kPointDamping;
  const Eigen::LLT<Matrix3d> factor(V);
  if (factor.info() != Eigen::Success) return;
  const Vector3d y = factor.matrixL().solve(b), z = factor.matrixL().solve(c);
  equations_.ll -= z.squaredNorm();
  equations_.lb -= z.dot(y);
  for (FreeGroup& f : free_) {
    f.U = factor.matrixL().solve(f.W.transpose()).transpose();
    equations_.r.segment<6>(6 * f.slot) -= f.U * y;
    equations_.h.segment<6>(6 * f.slot) -= f.U * z;
  }
  for (std::size_t a = 0; a < free_.size(); ++a) {  // slots ascend with the groups
    for (std::size_t d = 0; d <= a; ++d) {
      equations_.S.block<6, 6>(6 * free_[a].slot, 6 * free_[d].slot) -= free_[a].U * free_[d].U.transpose();
    }
  }
}

// How the free poses' translations change when the map grows about the first fixed pose: nothing in the images tells the
// map's own size from the length of the extrinsics, so that it is held.
Eigen::VectorXd growth(const ReprojectionProblem& problem, const std::vector<int>& pose_of_slot) {
  Vector3d centre = Vector3d::Zero();
  for (std::size_t i = 0; i < problem.pose_free.size(); ++i) {
    if (problem.pose_free[i]) continue;
    centre = problem.T_rig_world[i].inverse().translation();
    break;
  }
  Eigen::VectorXd out = Eigen::VectorXd::Zero(6 * static_cast<Eigen::Index>(pose_of_slot.size()));
  for (std::size_t slot = 0; slot < pose_of_slot.size(); ++slot) {
    const SE3& T = problem.T_rig_world[static_cast<std::size_t>(pose_of_slot[slot])];
    out.segment<3>(6 * static_cast<Eigen::Index>(slot) + 3) = T * centre;
  }
  return out;
}

}  // namespace

std::optional<RigScale> rig_scale(const ReprojectionProblem& problem, std::span<const std::uint8_t> skip) {
  const BundleStructure structure = make_structure(problem, skip);
  const std::size_t slots = structure.pose_of_slot.size();
  if (structure.num_points() == 0 || slots == 0) return std::nullopt;
  Equations eq = Assembly(problem, structure).run();
  const Eigen::VectorXd size = growth(problem, structure.pose_of_slot).normalized();
  if (!size.allFinite()) return std::nullopt;
  const double stiffness = eq.S.diagonal().maxCoeff();
  eq.S.diagonal() *= 1.0 + kPoseDamping;
  eq.S.selfadjointView<Eigen::Lower>().rankUpdate(size, stiffness);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(eq.S);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const double information = eq.ll - eq.h.dot(factor.solve(eq.h));
  if (!(information > kMinInformation * eq.lever)) return std::nullopt;
  const double length = 1.0 + (eq.lb - eq.h.dot(factor.solve(eq.r))) / information;
  if (!(length > 0.0)) return std::nullopt;
  const double unknowns = static_cast<double>(6 * slots + 3 * structure.num_points());
  const double redundancy = 2.0 * eq.terms - unknowns;
  if (!(redundancy > 0.0)) return std::nullopt;
  const double widened = std::max(1.0, eq.chi2 / redundancy);
  return RigScale{1.0 / length, std::sqrt(widened / information) / length};
}

}  // namespace bslam::solver
