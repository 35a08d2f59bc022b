#include "live_view/frame_data.h"

#include <vector>

#include "live_view/jpeg.h"
#include "session/report_arrays.h"

namespace bslam::live_view {
namespace {

using nlohmann::ordered_json;
using tracking::ObservedKeypoints;

constexpr int kMaxImageWidth = 480;

// The state of a keypoint; if several apply, the first one is used.
enum class KeypointKind : unsigned char { kUnmatched, kOutlier, kTracked };

ordered_json keypoint_arrays(const ObservedKeypoints& keypoints) {
  std::vector<KeypointKind> kind(keypoints.pixel.size(), KeypointKind::kUnmatched);
  for (const tracking::Match& m : keypoints.matched) kind[m.keypoint.index()] = KeypointKind::kOutlier;
  for (const tracking::Match& m : keypoints.inliers) kind[m.keypoint.index()] = KeypointKind::kTracked;
  std::vector<float> unmatched, outliers, tracked;
  for (std::size_t k = 0; k < kind.size(); ++k) {
    std::vector<float>& list = kind[k] == KeypointKind::kTracked   ? tracked
                               : kind[k] == KeypointKind::kOutlier ? outliers
                                                                   : unmatched;
    list.push_back(keypoints.pixel[k].x());
    list.push_back(keypoints.pixel[k].y());
  }
  return {{"tracked", session::float_array(tracked)},
          {"outliers", session::float_array(outliers)},
          {"unmatched", session::float_array(unmatched)}};
}

ordered_json camera_json(const session::ProcessedFrame& frame, std::size_t c) {
  const image::ImageView image = frame.images.images[c].view();
  const std::string jpeg = small_jpeg(image, kMaxImageWidth);
  const tracking::CameraStatus& status = frame.record.cameras[c];
  ordered_json json = c < frame.keypoints.size() ? keypoint_arrays(frame.keypoints[c]) : keypoint_arrays({});
  json["state"] = describe(status.state);
  json["reason"] = describe(status.reason);
  json["width"] = image.width;
  json["height"] = image.height;
  json["jpeg"] = jpeg.empty() ? ordered_json() : ordered_json(session::base64(jpeg));
  return json;
}

ordered_json pose_json(const session::ProcessedFrame& frame) {
  const tracking::TrackResult& result = frame.record.result;
  if (result.status != tracking::TrackStatus::kTracking) return nullptr;
  const auto T_rig_world = result.anchored.resolve(*frame.map);
  if (!T_rig_world) return nullptr;
  const geometry::SE3 T_world_rig = T_rig_world->inverse();
  const geometry::Vector3d& t = T_world_rig.translation();
  const Eigen::Quaterniond& q = T_world_rig.rotation();
  return {{"root", frame.map->root_of(result.anchored.reference).index()},
          {"position", {t.x(), t.y(), t.z()}},
          {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace

ordered_json frame_json(const session::ProcessedFrame& frame, double time_s) {
  const tracking::FrameRecord& record = frame.record;
  const bool tracking = record.result.status == tracking::TrackStatus::kTracking;
  ordered_json cameras = ordered_json::array();
  for (std::size_t c = 0; c < frame.images.images.size(); ++c) cameras.push_back(camera_json(frame, c));
  return {{"index", record.result.frame.index()},
          {"time", time_s},
          {"ms", record.frame_ms},
          {"tracking", tracking},
          {"reason", tracking ? "" : std::string(describe(record.result.reason))},
          {"keyframe", record.keyframe},
          {"direct", record.direct},
          {"pose", pose_json(frame)},
          {"cameras", std::move(cameras)}};
}

}  // namespace bslam::live_view
