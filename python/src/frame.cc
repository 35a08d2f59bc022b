// The result of a frame: classes Frame and CameraStatus.
#include <bslam/frame_result.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"

namespace bslam::python {
namespace {

using Frame = FrameResult;

std::optional<Matrix4x4> if_tracking(const Frame& f, const Pose& pose) {
  if (!f.tracking()) return std::nullopt;
  return matrix_of(pose);
}

std::optional<Matrix6x6> covariance(const Frame& f) {
  if (!f.covariance) return std::nullopt;
  return array_of<Matrix6x6>(*f.covariance, {6, 6});
}

std::optional<Vector3> velocity(const Frame& f, std::array<double, 3> Velocity::*part) {
  if (!f.velocity) return std::nullopt;
  return array_of<Vector3>((*f.velocity).*part, {3});
}

nb::typed<nb::dict, nb::str, double> stages(const Frame& f) {
  nb::dict out;
  for (const StageTime& s : f.stages) out[nb::str(s.stage.data(), s.stage.size())] = s.ms;
  return nb::borrow<nb::typed<nb::dict, nb::str, double>>(out);
}

std::string text_of(const Frame& f) {
  std::string out = "Frame(" + std::to_string(f.frame) + ", " + std::string(to_string(f.status));
  if (!f.tracking()) out += ": " + std::string(to_string(f.reason));
  return out + ")";
}

void bind_camera_status(nb::module_& module) {
  using C = CameraResult;
  nb::class_<C>(module, "CameraStatus", "State and number of keypoints of one camera in a frame.")
      .def_prop_ro(
          "state", [](const C& c) { return to_string(c.state); }, "ok, degraded or out (not used).")
      .def_ro("reason", &C::reason,
              "'' if ok, otherwise no-images, black, over-exposed, frozen, inconsistent, blurred or few-features.")
      .def_ro("keypoints", &C::keypoints, "Number of keypoints, or of landmarks searched for in the image.")
      .def_ro("matched", &C::matched, "Keypoints matched to landmarks of the map.")
      .def_ro("inliers", &C::inliers, "Matched keypoints that are consistent with the pose.")
      .def("__repr__", [](const C& c) {
        return "CameraStatus(" + std::string(to_string(c.state)) + (c.reason.empty() ? "" : ": ") +
               std::string(c.reason) + ", " + std::to_string(c.inliers) + " inliers)";
      });
}

void bind_poses(nb::class_<Frame>& frame) {
  frame
      .def_prop_ro(
          "T_world_cam0", [](const Frame& f) { return if_tracking(f, f.T_world_cam0); }, nb::rv_policy::move,
          "(4, 4) pose of camera 0 in the map, which jumps when a loop is closed; None unless tracking.")
      .def_prop_ro(
          "T_world_body", [](const Frame& f) { return if_tracking(f, f.T_world_body); }, nb::rv_policy::move,
          "(4, 4) pose of the body frame of the calibration in the map; None unless tracking.")
      .def_prop_ro(
          "T_odom_cam0", [](const Frame& f) { return matrix_of(f.T_odom_cam0); }, nb::rv_policy::move,
          "(4, 4) odometry pose of camera 0: not changed by corrections of the map; constant while lost.")
      .def_prop_ro(
          "T_odom_body", [](const Frame& f) { return matrix_of(f.T_odom_body); }, nb::rv_policy::move,
          "(4, 4) odometry pose of the body frame.")
      .def_prop_ro(
          "T_map_odom", [](const Frame& f) { return matrix_of(f.T_map_odom); }, nb::rv_policy::move,
          "(4, 4) with T_world_cam0 = T_map_odom @ T_odom_cam0.")
      .def_prop_ro(
          "covariance", covariance, nb::rv_policy::move,
          "(6, 6) covariance of the error d in T_world_cam0(true) = T_world_cam0 exp(d), rotation first (rad^2, rad m, "
          "m^2), in the axes of camera 0. None if unknown.")
      .def_prop_ro(
          "angular_velocity", [](const Frame& f) { return velocity(f, &Velocity::angular); }, nb::rv_policy::move,
          "(3,) rad/s, of the body frame in its own axes; None if unknown.")
      .def_prop_ro(
          "linear_velocity", [](const Frame& f) { return velocity(f, &Velocity::linear); }, nb::rv_policy::move,
          "(3,) m/s, of the origin of the body frame in its own axes; None if unknown.");
}

}  // namespace

void bind_frame(nb::module_& module) {
  bind_camera_status(module);
  nb::class_<Frame> frame(module, "Frame", "The result of one frame.");
  frame.def_ro("index", &Frame::frame, "Number of earlier frames.")
      .def_ro("time_ns", &Frame::time_ns, "Time of camera 0's image, with its time offset, in nanoseconds.")
      .def_prop_ro(
          "status", [](const Frame& f) { return to_string(f.status); }, "tracking, lost or not-started.")
      .def_prop_ro("tracking", &Frame::tracking, "Whether the frame has a pose.")
      .def_prop_ro(
          "reason", [](const Frame& f) { return to_string(f.reason); },
          "'' if tracking, otherwise not-started, no-images, few-features, few-matches, few-inliers, unstable-pose or "
          "not-found.")
      .def_prop_ro(
          "scale", [](const Frame& f) { return to_string(f.scale); },
          "metric: lengths are metres; up-to-scale or unobservable: they are in the unit of the map.")
      .def_ro("submap", &Frame::submap, "Id of the submap of the pose; poses of different submaps are unrelated.")
      .def_ro("cameras", &Frame::cameras, "One CameraStatus per camera of the rig.")
      .def_ro("unique_features", &Frame::unique_features, "Features of all cameras, each counted once.")
      .def_ro("matched_features", &Frame::matched_features, "Features observed by several cameras.")
      .def_ro("keyframe", &Frame::keyframe, "Whether the frame became a keyframe.")
      .def_ro("keyframe_id", &Frame::keyframe_id, "Its id, otherwise that of the reference keyframe; -1 if none.")
      .def_ro("relocalised", &Frame::relocalised, "Whether tracking was recovered by place recognition.")
      .def_ro("contested", &Frame::contested, "A second motion has more than half of the support of the chosen one.")
      .def_ro("map_withdrawn", &Frame::map_withdrawn, "The first map was wrong: all poses so far are invalid.")
      .def_prop_ro("stages", stages, "Wall time by stage, in milliseconds.")
      .def_ro("total_ms", &Frame::total_ms, "Wall time from the call to the pose, in milliseconds.")
      .def("__repr__", text_of);
  bind_poses(frame);
}

}  // namespace bslam::python
