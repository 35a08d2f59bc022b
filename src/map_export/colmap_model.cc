#include "map_export/colmap_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>

#include "map/rigs_of_map.h"

namespace bslam::map_export {
namespace {

using camera::Camera;
using geometry::SE3;

// Pixels; smaller motions between the images of a frame have no influence on the result.
constexpr double kMaxRigidShift_px = 0.05;

// Returns the name of a camera model in COLMAP, or an empty string if COLMAP does not have it.
std::string_view colmap_name(const camera::CameraModel& model) {
  if (std::holds_alternative<camera::Pinhole>(model)) return "PINHOLE";
  if (std::holds_alternative<camera::KannalaBrandt>(model)) return "OPENCV_FISHEYE";
  if (std::holds_alternative<camera::Fov>(model)) return "FOV";
  if (std::holds_alternative<camera::Unified>(model) || std::holds_alternative<camera::ExtendedUnified>(model))
    return "EUCM";
  if (!std::holds_alternative<camera::PinholeRadTan>(model)) return "";
  return camera::distortion(model).size() == 4 ? "OPENCV" : "FULL_OPENCV";
}

// Returns model, size and parameters in the format of cameras.txt.
std::string camera_text(const Camera& camera) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const std::vector<double> d = camera::distortion(camera.model);
  const std::string_view name = colmap_name(camera.model);
  std::vector<double> parameters = {k.fx, k.fy, k.cx + 0.5, k.cy + 0.5};
  parameters.insert(parameters.end(), d.begin(), d.end());
  if (name == "FULL_OPENCV") parameters.resize(12, 0.0);  // k1 k2 p1 p2 k3 k4 k5 k6
  if (name == "EUCM") parameters.resize(6, 1.0);          // the unified model is the extended one with beta = 1
  return fmt::format("{} {} {} {}", name, camera.width, camera.height, fmt::join(parameters, " "));
}

std::string pose_text(const SE3& T) {
  const geometry::Quaterniond& q = T.rotation();
  const geometry::Vector3d& t = T.translation();
  return fmt::format("{} {} {} {} {} {} {}", q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
}

// Writes one model. Ids of COLMAP are numbers of ours plus 1.
class Writer {
 public:
  Writer(const Selection& selection, const ImageTable& images, const OutputCameras& cameras,
         const LandmarkColours& colours, bool rigid)
      : map_(*selection.map),
        selection_(selection),
        images_(images),
        cameras_(cameras),
        colours_(colours),
        rigid_(rigid),
        first_(map::first_cameras_of_rigs(map_)) {
    if (!rigid) std::iota(first_.begin(), first_.end(), std::size_t{0});
  }

  ColmapModel write() {
    model_.rigs =
        "# RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID SENSORS[] as SENSOR_TYPE SENSOR_ID HAS_POSE QW QX QY "
        "QZ TX TY TZ\n";
    model_.frames = "# FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS DATA_IDS[] as SENSOR_TYPE SENSOR_ID DATA_ID\n";
    model_.cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
    model_.images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n";
    model_.points = "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n";
    write_cameras_and_rigs();
    write_frames();
    write_images();
    for (std::size_t i = 0; i < selection_.landmarks.size(); ++i) write_point(i);
    model_.mean_error_px = model_.landmarks > 0 ? error_sum_ / static_cast<double>(model_.landmarks) : 0.0;
    return std::move(model_);
  }

 private:
  void write_cameras_and_rigs() {
    for (std::size_t c = 0; c < map_.rig().size(); ++c) {
      model_.cameras += fmt::format("{} {}\n", c + 1, camera_text(cameras_.camera(c)));
      if (first_[c] == c) write_rig(c);
    }
  }

  // Writes the rig with this first camera, whose number it has.
  void write_rig(std::size_t first) {
    const camera::Rig& rig = map_.rig();
    std::string sensors;
    std::size_t end = first + 1;
    for (; end < rig.size() && first_[end] == first; ++end) {
      const SE3 T_cam_first = rig.cam_from_rig(end) * rig.rig_from_cam(first);
      sensors += fmt::format(" CAMERA {} 1 {}", end + 1, pose_text(T_cam_first));
    }
    model_.rigs += fmt::format("{0} {1} CAMERA {0}{2}\n", first + 1, end - first, sensors);
  }

  void write_frames() {
    for (std::size_t i = 0; i < images_.images().size() && !rigid_; ++i) {
      const MapImage& image = images_.images()[i];
      model_.frames += fmt::format("{} {} {} 1 CAMERA {} {}\n", i + 1, image.camera + 1,
                                   pose_text(pose(image.keyframe, image.camera)), image.camera + 1, i + 1);
    }
    for (const KeyframeId k : selection_.keyframes) {
      std::string data;
      std::size_t count = 0, first = 0;
      for (std::size_t c = 0; c < map_.rig().size(); ++c) {
        if (images_.of(k, c) < 0) continue;
        data += fmt::format(" CAMERA {} {}", c + 1, images_.of(k, c) + 1);
        first = first_[c];
        ++count;
      }
      if (count > 0 && rigid_)
        model_.frames +=
            fmt::format("{} {} {} {}{}\n", k.value() + 1, first + 1,
                        pose_text(map_.rig().cam_from_rig(first) * map_.keyframe(k).T_rig_world), count, data);
    }
  }

  SE3 pose(KeyframeId k, std::size_t c) const {
    return rigid_ ? map_.rig().cam_from_rig(c) * map_.keyframe(k).T_rig_world : map_.cam_from_world(k, CameraIndex(c));
  }

  // Writes all images, and remembers the place of each keypoint in the list of its image.
  void write_images() {
    for (const MapImage& image : images_.images()) {
      const map::BundledKeyframe& keyframe = map_.keyframe(image.keyframe);
      const feature::Keypoints& keypoints = keyframe.frame->cameras[image.camera].keypoints;
      std::vector<int>& place = place_.emplace_back(keypoints.size(), -1);
      int written = 0;
      fmt::format_to(std::back_inserter(model_.images), "{} {} {} {}\n", place_.size(),
                     pose_text(pose(image.keyframe, image.camera)), image.camera + 1, image.name);
      for (std::size_t i = 0; i < keypoints.size(); ++i) {
        const auto pixel = cameras_.pixel(image.camera, keypoints.pixel[i]);
        if (!pixel) continue;
        const FeatureId f = keyframe.frame->bundled.feature(CameraIndex(image.camera), KeypointIndex(i));
        const LandmarkId l = keyframe.landmarks[f.index()];
        const bool known = l.valid() && selection_.selected[map_.landmark(l).reference.keyframe.index()];
        fmt::format_to(std::back_inserter(model_.images), "{}{} {} {}", written == 0 ? "" : " ", pixel->x() + 0.5,
                       pixel->y() + 0.5, known ? l.value() + 1 : -1);
        place[i] = written++;
      }
      model_.images += '\n';
    }
  }

  void write_point(std::size_t i) {
    const LandmarkId l = selection_.landmarks[i];
    const Eigen::Vector3d& p = map_.landmark(l).position;
    std::string track;
    double error_px = 0;
    std::size_t seen = 0;
    for_each_keypoint(selection_, l, [&](KeyframeId k, frame::KeypointRef r) {
      const std::size_t c = r.camera.index();
      if (images_.of(k, c) < 0) return;
      const auto image = static_cast<std::size_t>(images_.of(k, c));
      const int place = place_[image][r.keypoint.index()];
      if (place < 0) return;
      fmt::format_to(std::back_inserter(track), " {} {}", image + 1, place);
      const auto projected = cameras_.camera(c).project(pose(k, c) * p);
      const auto observed = cameras_.pixel(c, map_.keypoints(k, r.camera).pixel[r.keypoint.index()]);
      if (!projected || !observed) return;
      error_px += (*projected - *observed).norm();
      ++seen;
    });
    if (track.empty()) return;
    if (seen > 0) error_px /= static_cast<double>(seen);
    error_sum_ += error_px;
    ++model_.landmarks;
    const Colour& colour = colours_.of[i];
    fmt::format_to(std::back_inserter(model_.points), "{} {} {} {} {} {} {} {}{}\n", l.value() + 1, p.x(), p.y(), p.z(),
                   colour[0], colour[1], colour[2], error_px, track);
  }

  const map::BundledMap& map_;
  const Selection& selection_;
  const ImageTable& images_;
  const OutputCameras& cameras_;
  const LandmarkColours& colours_;
  const bool rigid_;
  std::vector<std::size_t> first_;  // for each camera, the first one of its rig in COLMAP
  ColmapModel model_;
  std::vector<std::vector<int>> place_;  // per image and keypoint; -1: not in the model
  double error_sum_ = 0;
};

// Notes on differences between the model and the map.
std::vector<std::string> notes_of(const Selection& selection, const ImageTable& images, double shift_px) {
  std::vector<std::string> notes;
  const camera::Rig& rig = selection.map->rig();
  if (shift_px > kMaxRigidShift_px) {
    notes.push_back(fmt::format(
        "{}, which moves landmarks by up to {:.1f} px; COLMAP's rigs are rigid, so every camera is a rig of "
        "its own",
        rig.moves().empty() ? "the images of a keyframe were taken at different times"
                            : "cameras were moved relative to each other",
        shift_px));
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig.camera(c).readout_s == 0) continue;
    notes.push_back("COLMAP has no rolling shutter: the poses are those of the middle row of each image");
    break;
  }
  if (std::ranges::any_of(images.images(), [](const MapImage& i) { return i.name.find(' ') != std::string::npos; }))
    notes.push_back("names of images contain spaces, where the names in COLMAP's text format end");
  return notes;
}

}  // namespace

double largest_capture_shift_px(const Selection& selection) {
  const map::BundledMap& map = *selection.map;
  double largest = 0;
  for (const LandmarkId l : selection.landmarks) {
    const Eigen::Vector3d& p = map.landmark(l).position;
    for_each_keypoint(selection, l, [&](KeyframeId k, frame::KeypointRef r) {
      const auto& frame = *map.keyframe(k).frame;
      if (frame.cameras[r.camera.index()].time_ns == frame.time_ns && map.rig().moves().empty()) return;
      const Camera& camera = map.rig().camera(r.camera);
      const auto moved = camera.project(map.cam_from_world(k, r.camera) * p);
      const auto rigid = camera.project(map.rig().cam_from_rig(r.camera) * map.keyframe(k).T_rig_world * p);
      if (moved && rigid) largest = std::max(largest, (*moved - *rigid).norm());
    });
  }
  return largest;
}

Result<ColmapModel> colmap_model(const Selection& selection, const ImageTable& images, const OutputCameras& cameras,
                                 const LandmarkColours& colours) {
  for (std::size_t c = 0; c < selection.map->rig().size(); ++c) {
    const Camera& camera = cameras.camera(c);
    if (colmap_name(camera.model).empty())
      return Error{"", camera.name, std::string(camera::model_name(camera.model)),
                   "a camera model that COLMAP has; or undistorted images: --undistort --images DATA"};
  }
  const double shift_px = largest_capture_shift_px(selection);
  ColmapModel model = Writer(selection, images, cameras, colours, shift_px <= kMaxRigidShift_px).write();
  model.notes = notes_of(selection, images, shift_px);
  return model;
}

}  // namespace bslam::map_export
