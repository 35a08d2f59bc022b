#include "calibration/moved_camera.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/image_equations.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;
using geometry::Vector6d;

using Observation = solver::ReprojectionProblem::Observation;

// The cost of an observation with the extrinsics of camera c of the problem.
double cost(const solver::ReprojectionProblem& problem, const solver::RigValues& values, const Observation& o,
            std::size_t c) {
  const Eigen::Vector3d point = solver::point_in_camera(problem, values, o, c);
  const auto error = solver::residual_error(values.models[c], point, o.pixel.cast<double>());
  const double sigma = static_cast<double>(o.sigma);
  const double chi2 = error ? error->squaredNorm() / (sigma * sigma) : kMaxUsedChi2;
  return solver::huber_cost(std::min(chi2, kMaxUsedChi2));
}

// What an image of a camera says about a move.
struct PoseEvidence {
  double before = 0;  // decrease of the cost if it was captured before the move, not after it
  int observations = 0;
};

// Per pose of the problem. The cameras are those of the problem before and after the move.
std::vector<PoseEvidence> evidence_of(const RigProblem& problem, const solver::RigValues& values,
                                      std::size_t camera_before, std::size_t camera_after) {
  const solver::ReprojectionProblem& bundle = problem.selected.problem;
  std::vector<PoseEvidence> out(problem.selected.keyframes.size());
  for (const Observation& o : bundle.observations) {
    if (o.camera.index() != camera_before && o.camera.index() != camera_after) continue;
    PoseEvidence& pose = out[static_cast<std::size_t>(o.pose)];
    pose.before += cost(bundle, values, o, camera_after) - cost(bundle, values, o, camera_before);
    ++pose.observations;
  }
  return out;
}

// The first of the poses, which are in the order of time, after the move. Returns nullopt if too few images are before
// or after it: what looks like a move is then the error of these images.
std::optional<std::size_t> best_place(std::span<const std::size_t> poses, std::span<const PoseEvidence> evidence) {
  double sum = 0, most = 0;
  int images = 0, images_before = 0;
  std::optional<std::size_t> out;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    sum += evidence[poses[i]].before;
    images += evidence[poses[i]].observations >= kMinObservations;
    if (sum <= most) continue;
    most = sum;
    images_before = images;
    out = poses[i + 1];
  }
  if (!poses.empty()) images += evidence[poses.back()].observations >= kMinObservations;
  return std::min(images_before, images - images_before) < kMinKeyframes ? std::nullopt : out;
}

}  // namespace

MovedCameras::MovedCameras(std::size_t cameras, std::vector<camera::CameraMove> moves)
    : cameras_(cameras), moves_(std::move(moves)) {}

std::size_t MovedCameras::before(std::size_t m) const {
  for (std::size_t i = m; i-- > 0;) {
    if (moves_[i].camera == moves_[m].camera) return cameras_ + i;
  }
  return moves_[m].camera;
}

std::size_t MovedCameras::camera_at(std::size_t camera, TimeNs time_ns) const {
  std::size_t out = camera;
  for (std::size_t m = 0; m < moves_.size(); ++m) {
    if (moves_[m].camera == camera && moves_[m].time_ns <= time_ns) out = cameras_ + m;
  }
  return out;
}

camera::Rig MovedCameras::added_to(const camera::Rig& rig) const {
  if (moves_.empty()) return rig;
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  for (const camera::CameraMove& move : moves_) cameras.push_back(cameras[move.camera]);
  return camera::Rig(std::move(cameras));
}

solver::RigValues MovedCameras::added_to(solver::RigValues values) const {
  for (const camera::CameraMove& move : moves_) {
    values.T_cam_rig.push_back(move.T_after_initial * values.T_cam_rig[move.camera]);
    values.models.push_back(values.models[move.camera]);
    values.timing.push_back(values.timing[move.camera]);
  }
  return values;
}

RigAdjustmentOptions MovedCameras::added_to(RigAdjustmentOptions options) const {
  if (moves_.empty()) return options;
  for (std::size_t c = 0; c < cameras_; ++c) options.shared.push_back(c);
  for (const camera::CameraMove& move : moves_) {
    options.shared.push_back(move.camera);
    options.sigma_intrinsics.push_back(options.sigma_intrinsics[move.camera]);
    if (!options.timing.empty()) options.timing.push_back(options.timing[move.camera]);
  }
  return options;
}

solver::RigValues MovedCameras::of_rig(solver::RigValues values) const {
  values.T_cam_rig.resize(cameras_);
  values.models.erase(values.models.begin() + static_cast<std::ptrdiff_t>(cameras_), values.models.end());
  values.timing.resize(cameras_);
  return values;
}

std::vector<camera::CameraMove> MovedCameras::moves_of(const solver::RigValues& values) const {
  std::vector<camera::CameraMove> out = moves_;
  for (std::size_t m = 0; m < out.size(); ++m)
    out[m].T_after_initial = values.T_cam_rig[cameras_ + m] * values.T_cam_rig[out[m].camera].inverse();
  return out;
}

RigInformation MovedCameras::of_rig(const RigInformation& information) const {
  if (moves_.empty()) return information;
  const auto first = static_cast<Eigen::Index>(6 * (cameras_ - 1)), gone = static_cast<Eigen::Index>(6 * moves_.size());
  std::vector<Eigen::Index> kept, removed;
  for (Eigen::Index k = 0; k < information.change.size(); ++k)
    (k >= first && k < first + gone ? removed : kept).push_back(k);
  const auto marginal = [&](const Eigen::MatrixXd& of_all) -> Eigen::MatrixXd {
    const Eigen::MatrixXd own = of_all(kept, kept), coupling = of_all(kept, removed), others = of_all(removed, removed);
    return own - coupling * others.ldlt().solve(coupling.transpose());
  };
  return {information.change(kept), marginal(information.information), marginal(information.prior)};
}

void MovedCameras::separate(const map::BundledMap& map, RigProblem& problem) const {
  if (moves_.empty()) return;
  solver::ReprojectionProblem& bundle = problem.selected.problem;
  for (auto& o : bundle.observations)
    o.camera = CameraIndex(camera_at(o.camera.index(), time_of(map, problem, static_cast<std::size_t>(o.pose))));
  adjustment::sort_observations(problem.selected);
  std::vector<SE3> motion;
  for (std::size_t k = 0; k < bundle.motion.size(); k += cameras_) {
    for (std::size_t c = 0; c < cameras_; ++c) motion.push_back(bundle.motion[k + c]);
    for (const camera::CameraMove& move : moves_) motion.push_back(bundle.motion[k + move.camera]);
  }
  bundle.motion = std::move(motion);
}

void MovedCameras::join(const map::BundledMap& map, const solver::RigValues& values, RigProblem& problem) const {
  if (moves_.empty()) return;
  solver::ReprojectionProblem& bundle = problem.selected.problem;
  std::vector<SE3> motion;
  for (std::size_t pose = 0; pose < problem.selected.keyframes.size(); ++pose) {
    for (std::size_t c = 0; c < cameras_; ++c) {
      const std::size_t now = camera_at(c, map.keyframe(problem.selected.keyframes[pose]).frame->time_ns);
      SE3& T = motion.emplace_back();
      if (now != c) T = values.T_cam_rig[c].inverse() * values.T_cam_rig[now];
      if (!bundle.motion.empty()) T = T * bundle.motion[pose * (cameras_ + moves_.size()) + now];
    }
  }
  bundle.motion = std::move(motion);
  for (auto& o : bundle.observations) {
    if (o.camera.index() >= cameras_) o.camera = CameraIndex(moves_[o.camera.index() - cameras_].camera);
  }
  adjustment::sort_observations(problem.selected);
}

std::vector<PossibleMove> MovedCameras::likely_moves(const map::BundledMap& map, const RigProblem& problem,
                                                     const solver::RigValues& values, TimeNs from) const {
  const std::size_t cameras = values.T_cam_rig.size();
  const std::vector<std::size_t> poses = poses_by_time(map, problem);
  const std::vector<ImageEquations> equations = image_equations(problem, values);
  std::vector<PossibleMove> out;
  // Of two cameras, the images show the relative extrinsics only; of a single one, none.
  for (std::size_t c = cameras_ <= 2 ? 1 : 0; c < cameras; ++c) {
    ImageEquations all, after;
    PossibleMove best{.camera = c};
    for (const std::size_t pose : poses) all.add(equations[pose * cameras + c]);
    for (std::size_t i = poses.size(); i-- > 1;) {
      const std::size_t pose = poses[i];
      if (time_of(map, problem, pose) < from) break;
      after.add(equations[pose * cameras + c]);
      if (std::min(after.keyframes, all.keyframes - after.keyframes) < kMinKeyframes) continue;
      const auto [change, chi2] = best_change(all, after);
      if (std::isfinite(chi2) && chi2 > best.chi2) best = {c, pose, change, chi2};
    }
    if (best.chi2 > 0) out.push_back(best);
  }
  return out;
}

std::vector<camera::CameraMove> MovedCameras::at_best_times(const map::BundledMap& map, const RigProblem& problem,
                                                            const solver::RigValues& values) const {
  const std::vector<std::size_t> poses = poses_by_time(map, problem);
  const std::vector<camera::CameraMove> moves = moves_of(values);
  std::vector<camera::CameraMove> out;
  for (std::size_t m = 0; m < moves.size(); ++m) {
    const std::vector<PoseEvidence> evidence = evidence_of(problem, values, before(m), cameras_ + m);
    const auto first_after = best_place(poses, evidence);
    if (!first_after) continue;
    out.push_back(moves[m]);
    out.back().time_ns = time_of(map, problem, *first_after);
  }
  std::ranges::stable_sort(out, {}, &camera::CameraMove::time_ns);
  return out;
}

MovedCameras MovedCameras::with_move(const solver::RigValues& values, const PossibleMove& move, TimeNs time_ns) const {
  std::vector<camera::CameraMove> moves = moves_of(values);
  camera::CameraMove added{.camera = move.camera, .time_ns = time_ns, .T_after_initial = {}};
  if (move.camera >= cameras_)
    added = {moves[move.camera - cameras_].camera, time_ns, moves[move.camera - cameras_].T_after_initial};
  moves.push_back(added);
  std::ranges::stable_sort(moves, {}, &camera::CameraMove::time_ns);
  return {cameras_, std::move(moves)};
}

}  // namespace bslam::calibration
