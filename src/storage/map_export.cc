#include "storage/map_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "storage/map_bytes.h"

namespace bslam::storage {
namespace {

using camera::Camera;
using map::BundledKeyframe;
using map::BundledMap;

// Returns the name of a camera model in COLMAP, or an empty string if COLMAP does not support it.
std::string_view colmap_name(const camera::CameraModel& model) {
  if (std::holds_alternative<camera::Pinhole>(model)) return "PINHOLE";
  if (std::holds_alternative<camera::KannalaBrandt>(model)) return "OPENCV_FISHEYE";
  if (std::holds_alternative<camera::Fov>(model)) return "FOV";
  if (!std::holds_alternative<camera::PinholeRadTan>(model)) return "";
  return camera::distortion(model).size() == 4 ? "OPENCV" : "FULL_OPENCV";
}

// Returns model, size and parameters in the format of cameras.txt.
std::string colmap_camera(const Camera& camera) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const std::vector<double> d = camera::distortion(camera.model);
  const std::string_view name = colmap_name(camera.model);
  std::vector<double> parameters = {k.fx, k.fy, k.cx + 0.5, k.cy + 0.5};
  parameters.insert(parameters.end(), d.begin(), d.end());
  if (name == "FULL_OPENCV") parameters.resize(12, 0.0);  // k1 k2 p1 p2 k3 k4 k5 k6
  std::string line = fmt::format("{} {} {}", name, camera.width, camera.height);
  for (const double p : parameters) fmt::format_to(std::back_inserter(line), " {}", p);
  return line;
}

// Image ids of the COLMAP model.
struct Images {
  // Ids from 1 for every keyframe id and camera; 0 if there is no image.
  explicit Images(const BundledMap& map) : cameras(map.rig().size()), id(map.keyframe_slots() * cameras, 0) {
    std::size_t next = 1;
    for (const KeyframeId k : map.keyframe_ids()) {
      for (std::size_t c = 0; c < cameras; ++c) {
        if (map.keyframe(k).frame->cameras[c].state == image::ImageState::kPresent)
          id[k.index() * cameras + c] = next++;
      }
    }
  }
  std::size_t of(KeyframeId k, std::size_t c) const { return id[k.index() * cameras + c]; }

  std::size_t cameras;
  std::vector<std::size_t> id;
};

std::string image_name(const BundledMap& map, KeyframeId k, std::size_t c, const ImageNamer& name) {
  const Camera& camera = map.rig().camera(c);
  const TimeNs stamp_ns = map.keyframe(k).frame->cameras[c].time_ns - camera.time_offset_ns;
  return name ? name(c, stamp_ns) : fmt::format("{}/{}.png", camera.name, stamp_ns);
}

void append_image(const BundledMap& map, KeyframeId k, std::size_t c, std::size_t image, const ImageNamer& name,
                  std::string& out) {
  const BundledKeyframe& keyframe = map.keyframe(k);
  const frame::CameraFrame& seen = keyframe.frame->cameras[c];
  const geometry::SE3 T_cam_world = map.cam_from_world(k, CameraIndex(c));
  const geometry::Quaterniond& q = T_cam_world.rotation();
  const geometry::Vector3d& t = T_cam_world.translation();
  fmt::format_to(std::back_inserter(out), "{} {} {} {} {} {} {} {} {} {}\n", image, q.w(), q.x(), q.y(), q.z(), t.x(),
                 t.y(), t.z(), c + 1, image_name(map, k, c, name));
  for (std::size_t i = 0; i < seen.keypoints.size(); ++i) {
    const FeatureId f = keyframe.frame->bundled.feature(CameraIndex(c), KeypointIndex(i));
    const LandmarkId l = keyframe.landmarks[f.index()];
    const Eigen::Vector2f& p = seen.keypoints.pixel[i];
    fmt::format_to(std::back_inserter(out), "{}{} {} {}", i == 0 ? "" : " ", p.x() + 0.5f, p.y() + 0.5f,
                   l.valid() ? l.value() + 1 : -1);
  }
  out += '\n';
}

void append_point(const BundledMap& map, LandmarkId l, const Images& images, std::string& out) {
  const Eigen::Vector3d& p = map.landmark(l).position;
  std::string track;
  double error_px = 0;
  int seen = 0;
  for (const map::Observation& o : map.observations(l)) {
    const BundledKeyframe& k = map.keyframe(o.keyframe);
    for (const frame::KeypointRef r : k.frame->bundled.keypoints(o.feature)) {
      fmt::format_to(std::back_inserter(track), " {} {}", images.of(o.keyframe, r.camera.index()), r.keypoint.value());
      const auto pixel = map.rig().camera(r.camera).project(map.cam_from_world(o.keyframe, r.camera) * p);
      if (!pixel) continue;
      error_px += (*pixel - k.frame->keypoints(r.camera).pixel[r.keypoint.index()].cast<double>()).norm();
      ++seen;
    }
  }
  fmt::format_to(std::back_inserter(out), "{} {} {} {} 128 128 128 {}{}\n", l.value() + 1, p.x(), p.y(), p.z(),
                 seen > 0 ? error_px / seen : 0.0, track);
}

}  // namespace

std::vector<Submap> submaps_of(const BundledMap& map) {
  std::vector<Submap> submaps;
  std::vector<std::size_t> submap_index(map.keyframe_slots());
  for (const KeyframeId root : map.roots()) {
    Submap submap;
    submap.root = root;
    submap.keyframes = {root};
    for (std::size_t i = 0; i < submap.keyframes.size(); ++i) {
      const std::vector<KeyframeId>& children = map.keyframe(submap.keyframes[i]).children;
      submap.keyframes.insert(submap.keyframes.end(), children.begin(), children.end());
    }
    Eigen::AlignedBox3d box;
    for (const KeyframeId k : submap.keyframes) {
      submap_index[k.index()] = submaps.size();
      box.extend(map.keyframe(k).T_rig_world.inverse().translation());
    }
    submap.extent = box.sizes();
    std::ranges::sort(submap.keyframes, {},
                      [&](KeyframeId k) { return std::tuple(map.keyframe(k).frame->time_ns, k); });
    submaps.push_back(std::move(submap));
  }
  for (const LandmarkId l : map.landmark_ids())
    ++submaps[submap_index[map.landmark(l).reference.keyframe.index()]].landmarks;
  return submaps;
}

TimeNs first_time(const BundledMap& map, const Submap& submap) {
  return map.keyframe(submap.keyframes.front()).frame->time_ns;
}
TimeNs last_time(const BundledMap& map, const Submap& submap) {
  return map.keyframe(submap.keyframes.back()).frame->time_ns;
}

evaluation::Trajectory keyframe_trajectory(const BundledMap& map, const Submap& submap) {
  evaluation::Trajectory trajectory;
  for (const KeyframeId k : submap.keyframes) {
    const TimeNs time_ns = map.keyframe(k).frame->time_ns;
    if (!trajectory.empty() && trajectory.back().time_ns == time_ns) continue;
    trajectory.push_back({time_ns, map.keyframe(k).T_rig_world.inverse()});
  }
  return trajectory;
}

std::string landmarks_ply(const BundledMap& map) {
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment landmarks of a bslam map\nelement vertex {}\nproperty double x\n"
      "property double y\nproperty double z\nproperty int observations\nend_header\n",
      map.num_landmarks());
  ByteWriter out;
  for (const LandmarkId l : map.landmark_ids()) {
    std::int32_t keypoints = 0;
    for (const map::Observation& o : map.observations(l)) {
      keypoints += static_cast<std::int32_t>(map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature).size());
    }
    out.numbers(map.landmark(l).position.data(), 3);
    out.number(keypoints);
  }
  return std::move(header) + std::move(out).take();
}

Result<ColmapModel> colmap_model(const BundledMap& map, const ImageNamer& name) {
  ColmapModel model{"# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n",
                    "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n",
                    "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n"};
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
    const Camera& camera = map.rig().camera(c);
    if (colmap_name(camera.model).empty()) {
      return Error{"", camera.name, std::string(camera::model_name(camera.model)),
                   "a camera model that COLMAP supports"};
    }
    model.cameras += fmt::format("{} {}\n", c + 1, colmap_camera(camera));
  }
  const Images images(map);
  for (const KeyframeId k : map.keyframe_ids()) {
    for (std::size_t c = 0; c < map.rig().size(); ++c) {
      if (images.of(k, c) > 0) append_image(map, k, c, images.of(k, c), name, model.images);
    }
  }
  for (const LandmarkId l : map.landmark_ids()) append_point(map, l, images, model.points);
  return model;
}

}  // namespace bslam::storage
