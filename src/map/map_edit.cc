#include "map/map_edit.h"

#include "map/rebase.h"

namespace bslam::map {

MapDraft::MapDraft(MapSnapshot base) : edit_{std::move(base), {}}, working_(*edit_.base) {}

KeyframeId MapDraft::add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                                  std::vector<std::pair<FeatureId, LandmarkId>> matches, KeyframeId fallback_parent) {
  matches = usable_matches(working_, matches);
  const KeyframeId k = working_.add_keyframe(frame, T_rig_world, matches, fallback_parent);
  edit_.operations.emplace_back(
      AddKeyframe{k, std::move(frame), T_rig_world, std::move(matches), working_.keyframe(k).parent});
  return k;
}

LandmarkId MapDraft::add_landmark(const Eigen::Vector3d& position, std::vector<Observation> observations,
                                  const LandmarkReference& reference) {
  const LandmarkId l = working_.add_landmark(position, observations, reference);
  edit_.operations.emplace_back(AddLandmark{l, position, std::move(observations), working_.landmark(l).reference});
  return l;
}

bool MapDraft::add_observation(LandmarkId l, Observation o) {
  if (!working_.add_observation(l, o)) return false;
  edit_.operations.emplace_back(AddObservation{l, o});
  return true;
}

bool MapDraft::remove_observation(LandmarkId l, KeyframeId k) {
  if (!working_.remove_observation(l, k)) return false;
  edit_.operations.emplace_back(RemoveObservation{l, k});
  return true;
}

bool MapDraft::remove_landmark(LandmarkId l) {
  if (!working_.remove_landmark(l)) return false;
  edit_.operations.emplace_back(RemoveLandmark{l});
  return true;
}

bool MapDraft::merge_landmarks(LandmarkId from, LandmarkId into) {
  if (!working_.merge_landmarks(from, into)) return false;
  edit_.operations.emplace_back(MergeLandmarks{from, into});
  return true;
}

bool MapDraft::remove_keyframe(KeyframeId k) {
  if (!working_.remove_keyframe(k)) return false;
  edit_.operations.emplace_back(RemoveKeyframe{k});
  return true;
}

bool MapDraft::merge_submaps(KeyframeId child, KeyframeId parent) {
  if (!working_.merge_submaps(child, parent)) return false;
  edit_.operations.emplace_back(MergeSubmaps{child, parent});
  return true;
}

bool MapDraft::remove_submap(KeyframeId root) {
  if (!working_.remove_submap(root)) return false;
  edit_.operations.emplace_back(RemoveSubmap{root});
  return true;
}

bool MapDraft::scale_submap(KeyframeId root, double factor) {
  if (!working_.scale_submap(root, factor)) return false;
  edit_.operations.emplace_back(ScaleSubmap{root, factor});
  return true;
}

void MapDraft::set_poses(SetPoses poses) {
  std::erase_if(poses.keyframes, [&](const auto& entry) { return !working_.set_pose(entry.first, entry.second); });
  std::erase_if(poses.landmarks, [&](const auto& entry) { return !working_.set_position(entry.first, entry.second); });
  std::erase_if(poses.scale_changes, [&](const auto& entry) { return !working_.alive(entry.first); });
  std::erase_if(poses.uncertainties,
                [&](const auto& entry) { return !working_.set_uncertainty(entry.first, entry.second); });
  if (poses.keyframes.empty() && poses.landmarks.empty()) return;
  if (!poses.scale_changes.empty()) working_.scale_keyframes(poses.scale_changes);
  if (poses.correction) working_.begin_gauge_epoch();
  edit_.operations.emplace_back(std::move(poses));
}

void MapDraft::set_twists(std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists) {
  std::erase_if(twists, [&](const auto& entry) { return !working_.set_twist(entry.first, entry.second); });
  if (twists.empty()) return;
  edit_.operations.emplace_back(SetTwists{std::move(twists)});
}

void MapDraft::correct_times(std::vector<CaptureTime> changes) {
  std::erase_if(changes, [&](const CaptureTime& change) { return !working_.correct_time(change); });
  if (changes.empty()) return;
  edit_.operations.emplace_back(CorrectTimes{std::move(changes)});
}

void MapDraft::add_visibility_counts(std::vector<VisibilityCount> visibility_counts) {
  // The counts were collected over several map versions.
  for (VisibilityCount& s : visibility_counts) s.landmark = working_.resolve(s.landmark);
  std::erase_if(visibility_counts, [&](const VisibilityCount& s) {
    return !working_.add_visibility_counts(s.landmark, s.expected, s.found);
  });
  if (visibility_counts.empty()) return;
  edit_.operations.emplace_back(AddVisibilityCounts{std::move(visibility_counts)});
}

void MapDraft::refresh_landmarks(std::vector<LandmarkId> landmarks) {
  std::erase_if(landmarks, [&](LandmarkId l) { return !working_.refresh_landmark(l); });
  if (landmarks.empty()) return;
  edit_.operations.emplace_back(RefreshLandmarks{std::move(landmarks)});
}

void MapDraft::set_scale(Scale scale) {
  working_.set_scale(scale);
  edit_.operations.emplace_back(SetScale{scale, working_.scale_deviation()});
}

void MapDraft::set_scale(Scale scale, double deviation) {
  working_.set_scale(scale, deviation);
  edit_.operations.emplace_back(SetScale{scale, deviation});
}

void MapDraft::set_rig(camera::Rig rig, std::shared_ptr<const Eigen::MatrixXd> deviation) {
  const auto shared = std::make_shared<const camera::Rig>(std::move(rig));
  auto frames = working_.set_rig(shared, deviation);
  edit_.operations.emplace_back(SetRig{shared, std::move(deviation), std::move(frames)});
}

MapDraft::Finished MapDraft::finish() && { return {std::move(edit_), std::move(working_)}; }

}  // namespace bslam::map
