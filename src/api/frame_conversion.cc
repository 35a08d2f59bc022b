#include "api/frame_conversion.h"

#include <utility>

#include "api/conversions.h"

namespace bslam::api {
namespace {

using geometry::SE3;

TrackingStatus to_status(tracking::TrackStatus status) {
  switch (status) {
    case tracking::TrackStatus::kNotStarted:
      return TrackingStatus::kNotStarted;
    case tracking::TrackStatus::kTracking:
      return TrackingStatus::kTracking;
    case tracking::TrackStatus::kLost:
      return TrackingStatus::kLost;
  }
  return TrackingStatus::kLost;
}

LostReason to_reason(tracking::LostReason reason) {
  switch (reason) {
    case tracking::LostReason::kNone:
      return LostReason::kNone;
    case tracking::LostReason::kNotStarted:
      return LostReason::kNotStarted;
    case tracking::LostReason::kNoImages:
      return LostReason::kNoImages;
    case tracking::LostReason::kFewFeatures:
      return LostReason::kFewFeatures;
    case tracking::LostReason::kFewMatches:
      return LostReason::kFewMatches;
    case tracking::LostReason::kFewInliers:
      return LostReason::kFewInliers;
    case tracking::LostReason::kUnstablePose:
      return LostReason::kUnstablePose;
    case tracking::LostReason::kNotFound:
      return LostReason::kNotFound;
  }
  return LostReason::kNone;
}

constexpr std::pair<CameraState, tracking::CameraState> kCameraStates[] = {
    {CameraState::kOk, tracking::CameraState::kOk},
    {CameraState::kDegraded, tracking::CameraState::kDegraded},
    {CameraState::kOut, tracking::CameraState::kOut}};

CameraState to_state(tracking::CameraState state) {
  for (const auto& [outer, inner] : kCameraStates) {
    if (inner == state) return outer;
  }
  return CameraState::kOut;
}

std::vector<CameraResult> to_cameras(const tracking::FrameRecord& record) {
  std::vector<CameraResult> out(record.images.size());
  for (std::size_t c = 0; c < out.size(); ++c) {
    const tracking::CameraCounts& n = record.result.cameras[c];
    out[c].keypoints = n.keypoints;
    out[c].matched = n.matched;
    out[c].inliers = n.inliers;
    out[c].state = to_state(record.cameras[c].state);
    out[c].reason = tracking::describe(record.cameras[c].reason);
  }
  return out;
}

}  // namespace

FrameResult to_frame_result(const tracking::FrameRecord& record, const camera::Rig& rig) {
  const tracking::TrackResult& result = record.result;
  const SE3 T_body_rig = rig.body_from_rig();
  const SE3 T_rig_body = T_body_rig.inverse();
  FrameResult out;
  out.frame = result.frame.value();
  out.time_ns = result.time_ns;
  out.status =
      result.reason == tracking::LostReason::kNotStarted ? TrackingStatus::kNotStarted : to_status(result.status);
  out.reason = to_reason(result.reason);
  out.scale = to_scale(record.scale);
  if (out.tracking()) {
    const SE3 T_world_rig = result.T_rig_world.inverse();
    out.T_world_cam0 = to_pose(T_world_rig);
    out.T_world_body = to_pose(T_world_rig * T_rig_body);
    out.submap = record.root.value();
    if (result.covariance) out.covariance = to_covariance(*result.covariance);
  }
  if (record.twist) out.velocity = to_velocity(*record.twist, T_body_rig);
  const SE3 T_odom_rig = record.T_rig_odom.inverse();
  out.T_odom_cam0 = to_pose(T_odom_rig);
  out.T_odom_body = to_pose(T_odom_rig * T_rig_body);
  out.T_map_odom = to_pose(record.T_map_odom);
  out.cameras = to_cameras(record);
  out.unique_features = record.unique;
  out.matched_features = record.matched;
  out.keyframe = record.keyframe;
  out.contested = result.contest.contested;
  out.map_withdrawn = record.map_withdrawn;
  out.keyframe_id = result.anchored.reference.value();
  out.relocalised = record.relocalisation.has_value();
  for (const tracking::StageTime& s : record.stages) out.stages.push_back({s.stage, s.ms});
  out.total_ms = record.frame_ms;
  return out;
}

}  // namespace bslam::api

std::string_view bslam::to_string(CameraState state) {
  for (const auto& [outer, inner] : api::kCameraStates) {
    if (outer == state) return tracking::describe(inner);
  }
  return "";
}
