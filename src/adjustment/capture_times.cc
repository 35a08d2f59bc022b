#include "adjustment/capture_times.h"

#include <algorithm>

#include "frame/capture_times.h"
#include "solver/time_shifts.h"

namespace bslam::adjustment {
namespace {

using solver::PoseObservation;

// Per camera, the largest variance of the errors of its stamps in the keyframes; empty if all stamps are exact.
std::vector<double> stamp_variances(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<double> out(map.rig().size(), 0.0);
  for (const KeyframeId k : keyframes) {
    for (std::size_t c = 0; c < out.size(); ++c)
      out[c] = std::max(out[c], map.keyframe(k).frame->cameras[c].stamp_variance_s2);
  }
  if (std::ranges::none_of(out, [](double variance) { return variance > 0; })) out.clear();
  return out;
}

// The observations of each pose, camera by camera.
std::vector<std::vector<PoseObservation>> observations_by_pose(const solver::ReprojectionProblem& problem) {
  std::vector<std::vector<PoseObservation>> out(problem.T_rig_world.size());
  for (const auto& o : problem.observations) {
    out[static_cast<std::size_t>(o.pose)].push_back({o.camera, problem.points[static_cast<std::size_t>(o.point)],
                                                     o.pixel.cast<double>(), static_cast<double>(o.sigma)});
  }
  for (auto& of_pose : out) std::ranges::stable_sort(of_pose, {}, &PoseObservation::camera);
  return out;
}

// Number of the observations of each camera which an adjustment of the whole map would contain.
std::vector<std::size_t> count_observations(const map::BundledMap& map, const map::BundledKeyframe& keyframe) {
  std::vector<std::size_t> out(map.rig().size(), 0);
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    const LandmarkId l = keyframe.landmarks[f];
    if (!l.valid() || map.observations(l).size() < 2) continue;
    for (const frame::KeypointRef r : keyframe.frame->bundled.keypoints(FeatureId(f))) ++out[r.camera.index()];
  }
  return out;
}

// Flags the images whose capture times are corrected: their camera has wrong stamps and is not the reference camera,
// and the problem has at least half of their observations. Otherwise tracking knows more.
std::vector<std::uint8_t> correctable(const map::BundledMap& map, const map::BundledKeyframe& keyframe,
                                      std::span<const double> variances,
                                      std::span<const PoseObservation> observations) {
  const frame::BundledFrame& frame = *keyframe.frame;
  const std::vector<std::size_t> all = count_observations(map, keyframe);
  std::vector<std::size_t> present(all.size(), 0);
  for (const PoseObservation& o : observations) ++present[o.camera.index()];
  std::vector<std::uint8_t> out(present.size(), 0);
  const std::size_t reference = frame::reference_camera(frame);
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c] = c != reference && variances[c] > 0 && frame.cameras[c].state == image::ImageState::kPresent &&
             present[c] > 0 && 2 * present[c] >= all[c];
  }
  return out;
}

// Of the errors that remain after the present corrections.
solver::ShiftPrior prior_of(const frame::BundledFrame& frame, std::span<const double> variances,
                            std::span<const std::uint8_t> corrected) {
  solver::ShiftPrior out(variances.size());
  for (std::size_t c = 0; c < variances.size(); ++c) {
    if (corrected[c]) out.set(c, variances[c], to_seconds(frame.cameras[c].correction_ns));
  }
  return out;
}

}  // namespace

std::vector<map::CaptureTime> correct_capture_times(const map::BundledMap& map, BundleProblem& selected) {
  std::vector<map::CaptureTime> out;
  const std::vector<double> variances = stamp_variances(map, selected.keyframes);
  if (variances.empty()) return out;
  solver::ReprojectionProblem& problem = selected.problem;
  const std::size_t cameras = variances.size();
  const auto observations = observations_by_pose(problem);
  problem.motion.resize(selected.keyframes.size() * cameras);  // without motions, they are the identity
  for (std::size_t pose = 0; pose < selected.keyframes.size(); ++pose) {
    const map::BundledKeyframe& keyframe = map.keyframe(selected.keyframes[pose]);
    const frame::BundledFrame& frame = *keyframe.frame;
    if (keyframe.twist.isZero(0)) continue;
    const std::vector<std::uint8_t> corrected = correctable(map, keyframe, variances, observations[pose]);
    if (std::ranges::find(corrected, 1) == corrected.end()) continue;
    const auto found = solver::time_shift_step(frame::rig_of(map.rig(), frame, keyframe.twist), observations[pose],
                                               problem.T_rig_world[pose], keyframe.twist,
                                               prior_of(frame, variances, corrected), problem.pose_free[pose] != 0);
    if (!found.all_finite()) continue;
    problem.T_rig_world[pose] = problem.T_rig_world[pose].perturbed(found.pose);
    for (std::size_t c = 0; c < cameras; ++c) {
      if (!corrected[c]) continue;
      const double shift_s = found.shift_s(static_cast<Eigen::Index>(c));
      geometry::SE3& motion = problem.motion[pose * cameras + c];
      motion = motion * geometry::SE3::exp(shift_s * keyframe.twist);
      out.push_back({selected.keyframes[pose], CameraIndex(c), frame.cameras[c].correction_ns + from_seconds(shift_s)});
    }
  }
  return out;
}

}  // namespace bslam::adjustment
