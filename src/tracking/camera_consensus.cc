#include "tracking/camera_consensus.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace bslam::tracking {

using geometry::SE3;

CameraTrust trusted(bool established) {
  CameraTrust camera;
  camera.established = established;
  return camera;
}

std::vector<CameraTrust> doubts_of(std::vector<CameraTrust> cameras, const std::vector<int>& seen,
                                   const ConsensusOptions& options) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    cameras[c].landmarks.clear();
    if (seen[c] >= options.min_expected) cameras[c] = trusted(true);
  }
  return cameras;
}

std::vector<Expectation> continuity(const map::BundledMap& map, const frame::BundledFrame& frame,
                                    const SE3& T_rig_world, const std::vector<CameraTrust>& trust,
                                    const FrameMatches& found) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<Expectation> out(trust.size());
  for (std::size_t c = 0; c < trust.size(); ++c) {
    if (frame.cameras[c].state != image::ImageState::kPresent || trust[c].doubted) continue;
    std::vector<LandmarkId> again;
    if (c < found.size()) {
      for (const Match& m : found[c]) again.push_back(m.landmark);
    }
    std::sort(again.begin(), again.end());
    const SE3 T_cam_world = rig.cam_from_rig(c) * T_rig_world;
    for (const LandmarkId before : trust[c].landmarks) {
      const LandmarkId l = map.resolve(before);
      if (!l.valid()) continue;
      const auto pixel = rig.camera(c).project(T_cam_world * map.landmark(l).position);
      if (!pixel || !rig.camera(c).contains(*pixel)) continue;
      ++out[c].expected;
      out[c].found += std::binary_search(again.begin(), again.end(), l);
    }
  }
  return out;
}

std::vector<std::uint8_t> contradicting(const FrameMatches& matches, const std::vector<int>& inliers_per_camera,
                                        const std::vector<CameraTrust>& trust, const ConsensusOptions& options) {
  std::vector<std::uint8_t> out(matches.size(), 0);
  for (std::size_t c = 0; c < trust.size(); ++c) {
    if (!trust[c].established) continue;
    const auto found = static_cast<int>(matches[c].size());
    out[c] = found >= options.min_expected && inliers_per_camera[c] < options.conflict_inlier_ratio * found;
  }
  return out;
}

solver::PoseSolution pose_of_most_consistent_camera(const camera::Rig& rig, const FrameMatches& matches,
                                                    std::span<const solver::PoseObservation> observations,
                                                    const SE3& predicted, const ConsensusOptions& options,
                                                    const solver::PoseSolverOptions& pose) {
  constexpr double kRadiansPerMetre = 1.0;  // turning as much as passing something a metre away
  constexpr double kAgrees = 25.0;          // squared normalised error at a camera's own pose
  solver::PoseSolution best;
  double least = std::numeric_limits<double>::infinity();
  std::size_t first = 0;
  for (const auto& camera : matches) {
    const auto own = observations.subspan(first, camera.size());
    first += camera.size();
    if (static_cast<int>(camera.size()) < options.min_expected) continue;
    const solver::PoseSolution alone = solver::solve_pose(rig, own, predicted, pose);
    if (!alone.ok || alone.num_inliers < options.healthy_reobservation_ratio * static_cast<double>(camera.size()))
      continue;
    const geometry::Vector6d off = (alone.T_rig_world * predicted.inverse()).log();
    const double distance = off.head<3>().norm() + kRadiansPerMetre * off.tail<3>().norm();
    if (distance >= least) continue;
    solver::PoseSolverOptions near = pose;
    near.first_chi2 = kAgrees;
    solver::PoseSolution joint = solver::solve_pose(rig, observations, alone.T_rig_world, near);
    if (!joint.ok) continue;
    least = distance;
    best = std::move(joint);
  }
  return best;
}

std::vector<std::uint8_t> disagreeing(const std::vector<Expectation>& continuity, const std::vector<CameraTrust>& trust,
                                      const ConsensusOptions& options) {
  std::vector<std::uint8_t> out(continuity.size(), 0);
  const auto counts = [&](const Expectation& e) { return e.expected >= options.min_expected; };
  const bool sound = std::ranges::any_of(
      continuity, [&](const Expectation& e) { return counts(e) && e.share() >= options.healthy_reobservation_ratio; });
  for (std::size_t c = 0; sound && c < out.size(); ++c) {
    out[c] = counts(continuity[c]) && continuity[c].share() < options.min_reobservation_ratio &&
             trust[c].share >= options.previous_reobservation_ratio;
  }
  return out;
}

void trust(CameraTrust& camera, const Expectation& continuity, const ConsensusOptions& options) {
  if (continuity.expected >= options.min_expected) camera.share = continuity.share();
}

void doubt(CameraTrust& camera, const Expectation& view, TimeNs time_ns, const ConsensusOptions& options) {
  camera.landmarks.clear();
  if (!std::exchange(camera.doubted, true)) camera.judged_ns = camera.since_ns = time_ns;
  const bool judged = view.expected >= options.min_expected;
  if (judged) {
    camera.seeing = view.share() >= options.readmission_ratio ? camera.seeing + 1 : 0;
    camera.judged_ns = time_ns;
  }
  const bool forgotten = to_seconds(time_ns - camera.judged_ns) >= options.forget_after_s;
  if (camera.seeing >= options.readmit_after || forgotten) camera = trusted(camera.established);
}

bool due_for_retry(const CameraTrust& camera, TimeNs time_ns, const ConsensusOptions& options) {
  return camera.doubted && to_seconds(time_ns - camera.since_ns) >= options.retry_after_s;
}

void retry(CameraTrust& camera, const Expectation& wide, TimeNs time_ns, const ConsensusOptions& options) {
  if (wide.expected >= options.min_expected && wide.share() >= options.readmission_ratio) {
    camera.since_ns = time_ns;
  } else {
    camera = trusted(camera.established);
  }
}

void leave_out(const camera::Rig& rig, std::size_t camera, double min_parallax, double max_chi2,
               frame::BundledFrame& frame) {
  std::vector<std::vector<frame::KeypointRef>> matched;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    const auto all = frame.bundled.keypoints(FeatureId(f));
    std::vector<frame::KeypointRef> rest;
    std::copy_if(all.begin(), all.end(), std::back_inserter(rest),
                 [&](const frame::KeypointRef& r) { return r.camera.index() != camera; });
    if (rest.size() >= 2) matched.push_back(std::move(rest));
  }
  frame::CameraFrame& out = frame.cameras[camera];
  out.state = image::ImageState::kMissing;
  out.keypoints = {};
  out.words.clear();
  out.grid = frame::FeatureGrid(out.keypoints, rig.camera(camera).width, rig.camera(camera).height);
  frame.bundled = matching::make_bundled(frame::rig_of(rig, frame), frame.cameras, matched, min_parallax, max_chi2);
}

}  // namespace bslam::tracking
