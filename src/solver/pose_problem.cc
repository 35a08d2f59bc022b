#include "solver/pose_problem.h"

#include <algorithm>
#include <limits>
#include <variant>

#include "base/assert.h"

namespace bslam::solver {
namespace {

using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::Vector6d;

struct CameraPose {
  Matrix3d R;  // R_cam_world
  Vector3d t;  // metres
  const camera::Shutter& shutter;

  // The item's point in the camera frame at the capture time.
  Vector3d at_capture(const PoseProblem::Item& item) const { return R * item.point_world + t; }
  // The same when the row of its pixel was exposed.
  Vector3d at_exposure(const PoseProblem::Item& item) const { return shutter.at_row(at_capture(item), item.pixel.y()); }
};

CameraPose camera_pose(const SE3& T_cam_world, const camera::Shutter& shutter) {
  return {T_cam_world.matrix3(), T_cam_world.translation(), shutter};
}

// Squared normalised error; infinite if the point does not project.
template <class Model>
double squared_error(const Model& model, const CameraPose& pose, const PoseProblem::Item& item) {
  const auto error = residual_error(model, pose.at_exposure(item), item.pixel);
  if (!error) return std::numeric_limits<double>::infinity();
  return error->squaredNorm() * item.inverse_sigma * item.inverse_sigma;
}

// Adds one observation to equations in the camera's own perturbation, T_cam_world <- exp(delta) T_cam_world, whose
// Jacobian needs no rotation (docs/math.md, section 4).
void accumulate(const Residual& residual, const Vector3d& point_cam, double weight, PoseEquations& out) {
  const Matrix62d Jt = pose_jacobian_transposed(residual.J, point_cam), wJt = weight * Jt;
  for (int c = 0; c < 6; ++c) out.H.col(c) += wJt.col(0) * Jt(c, 0) + wJt.col(1) * Jt(c, 1);
  out.b += wJt.col(0) * residual.error.x() + wJt.col(1) * residual.error.y();
}

// `admit(item, chi2)` returns whether an item is used, and may change it.
template <class Model, class Items, class Admit>
void accumulate_camera(const Model& model, const CameraPose& pose, Items items, Kernel kernel, const Admit& admit,
                       PoseEquations& out) {
  for (auto& item : items) {
    if (!admit.worth_a_look(item)) continue;
    const Vector3d p = pose.at_capture(item);
    auto r = residual(model, pose.shutter.at_row(p, item.pixel.y()), item.pixel);
    const double information = item.inverse_sigma * item.inverse_sigma;
    const double chi2 = r ? r->error.squaredNorm() * information : std::numeric_limits<double>::infinity();
    if (!admit(item, chi2)) continue;
    out.cost += 0.5 * kernel_cost(kernel, chi2);
    if (r && pose.shutter.rolling()) r->J *= pose.shutter.row_jacobian(item.pixel.y());
    if (chi2 < kMaxChi2) accumulate(*r, p, kernel_weight(kernel, chi2) * information, out);
  }
}

struct AdmitInUse {
  bool worth_a_look(const PoseProblem::Item& item) const { return item.in_use; }
  bool operator()(const PoseProblem::Item&, double) const { return true; }
};

struct AdmitWithinBound {
  double bound;
  int& changed;
  int& num_in_use;
  bool worth_a_look(const PoseProblem::Item&) const { return true; }
  bool operator()(PoseProblem::Item& item, double chi2) const {
    const bool in_use = chi2 <= bound;
    changed += in_use != item.in_use;
    num_in_use += in_use - item.in_use;
    return item.in_use = in_use;
  }
};

// Converts a camera's equations to those of the rig.
void add_in_rig(const Matrix6d& J, const PoseEquations& camera, PoseEquations& rig) {
  rig.H += J.transpose() * camera.H * J;
  rig.b += J.transpose() * camera.b;
  rig.cost += camera.cost;
}

}  // namespace

PoseProblem::PoseProblem(const Rig& rig, std::span<const PoseObservation> observations, const MotionModel* motion)
    : rig_(&rig), motion_(motion), items_(observations.size()), first_(rig.size() + 1, 0) {
  for (const PoseObservation& o : observations) {
    BSLAM_ASSERT(o.camera.valid() && o.camera.index() < rig.size(), "an observation must refer to a camera of the rig");
    BSLAM_ASSERT(o.sigma > 0, "standard deviations must be positive");
    ++first_[o.camera.index() + 1];
  }
  for (std::size_t i = 0; i < rig.size(); ++i) first_[i + 1] += first_[i];
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const PoseObservation& o = observations[k];
    items_[next[o.camera.index()]++] = {o.point_world, o.pixel, 1.0 / o.sigma, o.camera, static_cast<int>(k), false};
  }
}

// T exp(delta) = exp(Ad_T delta) T. With T_cam_rig = T_i0 exp(delay twist), the pose's change moves the camera directly
// and by the change of the twist, gain * J_l^-1(step) delta, which moves it by J_l(delay twist) times delay. Both left
// Jacobians J_l(x) of SE(3) are replaced by Ad(exp(x / 2)), which differs in second order (docs/math.md, section 13).
// The change of the velocity moves the rows of a rolling shutter in opposite directions about the middle one; this is
// not part of J.
PoseProblem::CameraMotion PoseProblem::camera_motion(std::size_t i, const SE3& T_rig_world) const {
  const SE3& T_i0 = rig_->cam_from_rig(i);
  if (motion_ == nullptr) return {T_i0, T_i0.adjoint(), rig_->shutter(i)};
  const double delay = motion_->delay_s[i];
  if (delay == 0.0 && rig_->camera(i).readout_s == 0) return {T_i0, T_i0.adjoint(), {}};
  const geometry::Vector6d step = motion_->step(T_rig_world);
  const geometry::Vector6d twist = motion_->gain * step + motion_->offset;
  if (delay == 0.0) return {T_i0, T_i0.adjoint(), {rig_->camera(i), T_i0, twist}};
  const SE3 half = SE3::exp(0.5 * delay * twist);
  const SE3 T_cam_rig = T_i0 * half * half;
  return {T_cam_rig,
          T_cam_rig.adjoint() + delay * motion_->gain * (T_i0 * half * SE3::exp(-0.5 * step)).adjoint(),
          {rig_->camera(i), T_cam_rig, twist}};
}

int PoseProblem::select(const SE3& T_rig_world, double bound) {
  int changed = 0;
  const AdmitWithinBound admit{bound, changed, num_in_use_};
  for (std::size_t i = 0; i < rig_->size(); ++i) {
    const CameraMotion motion = camera_motion(i, T_rig_world);
    const CameraPose pose = camera_pose(motion.T_cam_rig * T_rig_world, motion.shutter);
    std::visit(
        [&](const auto& model) {
          for (Item& item : of_camera(i)) admit(item, squared_error(model, pose, item));
        },
        rig_->camera(i).model);
  }
  return changed;
}

PoseEquations PoseProblem::linearise(const SE3& T_rig_world, Kernel kernel) const {
  PoseEquations out;
  for (std::size_t i = 0; i < rig_->size(); ++i) {
    const CameraMotion motion = camera_motion(i, T_rig_world);
    const CameraPose pose = camera_pose(motion.T_cam_rig * T_rig_world, motion.shutter);
    PoseEquations camera;
    std::visit([&](const auto& model) { accumulate_camera(model, pose, of_camera(i), kernel, AdmitInUse{}, camera); },
               rig_->camera(i).model);
    add_in_rig(motion.J, camera, out);
  }
  return out;
}

PoseEquations PoseProblem::reselect_and_linearise(const SE3& T_rig_world, Kernel kernel, double bound, int& changed) {
  PoseEquations out;
  changed = 0;
  const AdmitWithinBound admit{bound, changed, num_in_use_};
  for (std::size_t i = 0; i < rig_->size(); ++i) {
    const CameraMotion motion = camera_motion(i, T_rig_world);
    const CameraPose pose = camera_pose(motion.T_cam_rig * T_rig_world, motion.shutter);
    PoseEquations camera;
    std::visit([&](const auto& model) { accumulate_camera(model, pose, of_camera(i), kernel, admit, camera); },
               rig_->camera(i).model);
    add_in_rig(motion.J, camera, out);
  }
  return out;
}

double PoseProblem::truncated_cost(const SE3& T_rig_world, double bound, double limit) const {
  double cost = 0.0;
  for (std::size_t i = 0; i < rig_->size() && cost <= limit; ++i) {
    const CameraMotion motion = camera_motion(i, T_rig_world);
    const CameraPose pose = camera_pose(motion.T_cam_rig * T_rig_world, motion.shutter);
    std::visit(
        [&](const auto& model) {
          for (const Item& item : of_camera(i)) {
            const double chi2 = squared_error(model, pose, item);
            cost += chi2 < bound ? chi2 : bound;
            if (cost > limit) return;
          }
        },
        rig_->camera(i).model);
  }
  return cost;
}

SE3 refine_pose(const PoseProblem& problem, const SE3& T_rig_world, const PoseEquations& equations, Kernel kernel,
                int iterations, double tolerance) {
  const auto equations_at = [&](const SE3& T) { return problem.linearise(T, kernel); };
  const auto plus = [](const SE3& T, const Vector6d& delta) { return T.perturbed(delta); };
  SmallProblem<6, SE3, decltype(equations_at), decltype(plus)> steps(T_rig_world, equations, equations_at, plus);
  minimise(steps, {.iterations = iterations,
                   .relative_decrease = 0.0,
                   .step_tolerance = tolerance,
                   .min_gain = 0.0,
                   .rule = DampingRule::kOnFailure,
                   .first_damping = 1e-3});
  return steps.state();
}

}  // namespace bslam::solver
