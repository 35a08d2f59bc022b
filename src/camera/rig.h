// The rig: N cameras and their extrinsics, which are constant unless cameras were moved. The rig frame is the frame of
// camera 0 (the paper's camera 1) as it was calibrated, so T_cam_rig of camera 0 is the identity, except for the
// rotation of a refined calibration (see the constructor). The paper's T_i1 is T_cam_rig of camera i, and c_i = T_i1
// c_1 is cam_from_rig(i) * T_rig_world.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/id.h"
#include "base/result.h"
#include "base/timestamp.h"
#include "camera/camera.h"
#include "camera/rolling_shutter.h"
#include "geometry/se3.h"

namespace bslam::camera {

struct RigCamera {
  Camera camera;
  geometry::SE3 T_body_cam;  // from the calibration file
};

// A camera that was moved relative to the rig during a recording, because it was hit or its mount slipped. From a time
// on, T_cam_rig is T_after_initial T_cam_rig, up to its next move. T_after_initial refers to the extrinsics at the
// beginning of the recording, also if there is an earlier move.
struct CameraMove {
  std::size_t camera = 0;
  TimeNs time_ns = 0;
  geometry::SE3 T_after_initial;
};

// Immutable; copies share the calibration.
class Rig {
 public:
  // There must be at least one camera; the first one becomes camera 0. `T_cam0_rig`: a refined calibration that moves
  // the principal point of camera 0 turns its frame, because the rays of the pixels stay where they are in the body.
  // The rig frame, whose poses are reported, does not turn.
  explicit Rig(std::vector<RigCamera> cameras, const geometry::SE3& T_cam0_rig = {});

  std::size_t size() const { return T_cam_rig_.size(); }
  const Camera& camera(CameraIndex i) const { return calibration_->cameras[i.index()].camera; }
  const Camera& camera(std::size_t i) const { return calibration_->cameras[i].camera; }

  // T_cam_rig: maps coordinates in the rig frame (camera 0) to the frame of camera i.
  const geometry::SE3& cam_from_rig(std::size_t i) const { return T_cam_rig_[i]; }
  const geometry::SE3& cam_from_rig(CameraIndex i) const { return T_cam_rig_[i.index()]; }
  const geometry::SE3& rig_from_cam(std::size_t i) const { return T_rig_cam_[i]; }
  // The motion of camera i during the exposure of its rows; none if the rig is not `moving`. The poses above are those
  // at the exposure of the middle row.
  const Shutter& shutter(std::size_t i) const { return shutters_.empty() ? kGlobalShutter : shutters_[i]; }
  // T_cam_rig at the exposure of the row at this height.
  geometry::SE3 cam_from_rig(CameraIndex i, double pixel_y) const {
    return shutter(i.index()).pose_at_row(cam_from_rig(i), pixel_y);
  }

  // T_body_cam. The body frame is used for input and output only.
  const geometry::SE3& body_from_cam(std::size_t i) const { return calibration_->cameras[i].T_body_cam; }
  geometry::SE3 body_from_rig() const { return body_from_cam(0) * T_cam_rig_.front(); }
  // The frame whose poses a run reports that begins with camera i: the rig frame, or that of another camera. Its pose
  // in the rig frame and in the body.
  geometry::SE3 rig_from_first(std::size_t i) const { return i == 0 ? geometry::SE3() : rig_from_cam(i); }
  geometry::SE3 body_from_first(std::size_t i) const { return i == 0 ? body_from_rig() : body_from_cam(i); }

  // The moves of cameras during the recording, in order of time; usually there are none. All other functions give the
  // extrinsics at its beginning.
  std::span<const CameraMove> moves() const { return moves_ ? std::span(*moves_) : std::span<const CameraMove>(); }
  Rig with_moves(std::vector<CameraMove> moves) const;
  // T_cam_rig of a camera at a time, and the rig with the extrinsics of a time, which has no moves.
  geometry::SE3 cam_from_rig_at(std::size_t i, TimeNs time_ns) const;
  Rig at(TimeNs time_ns) const;
  // The rig as it is after all moves, as a rig without moves.
  Rig after_moves() const;

  // A lower bound of the cosine of the angle between the optical axis and the ray of any pixel, with a margin for the
  // motion during a rolling shutter; -1 if it is not known, since not every pixel at the border has a ray.
  double min_axis_cosine(CameraIndex i) const { return calibration_->min_axis_cosine[i.index()]; }

  // Returns true if the fields of view of cameras i and j overlap at some depth. Sampled from the calibration.
  bool overlap(std::size_t i, std::size_t j) const { return overlap_share(i, j) > kMinOverlap; }
  // overlap() in either direction.
  bool share_view(std::size_t i, std::size_t j) const { return overlap(i, j) || overlap(j, i); }
  // Fraction of camera i's image that is in view of camera j, in [0, 1]; the maximum over the sampled depths.
  double overlap_share(std::size_t i, std::size_t j) const { return calibration_->overlap[i * size() + j]; }
  // Returns true if any two cameras overlap, so that metric depth is observable without motion. `ignored` has one entry
  // per camera, non-zero for cameras to ignore; it may be empty.
  bool any_overlap(std::span<const std::uint8_t> ignored = {}) const;

  // The same cameras, with the frame of camera 0 as the rig frame.
  Rig in_frame_of_camera_0() const {
    return T_cam_rig_.front().matrix().isIdentity(0)
               ? *this
               : Rig(calibration_->cameras).with_moves({moves().begin(), moves().end()});
  }
  // Returns the rig that consists of the given cameras, in the given order; the first becomes camera 0. The indices
  // must be valid and distinct.
  Rig subset(std::span<const int> indices) const;
  // The inverse of `subset`: returns this rig with models, timing, extrinsics (T_body_cam) and moves of the cameras
  // `indices` taken from `part`, and with its rig frame if both begin with the same camera.
  Rig with_calibration_of(const Rig& part, std::span<const int> indices) const;

  // Whether all cameras of two rigs have the same model with the same parameters, and whether they also have the same
  // time offsets, readout times, extrinsics and moves. The rigs must have the same number of cameras.
  bool same_intrinsics(const Rig& other) const;
  bool same_calibration(const Rig& other) const;

  // Returns the rig for cameras with different capture times, under a constant-velocity model. Camera i takes its image
  // `delay_s[i]` seconds after the time of the rig; in that time the rig moves by exp(delay twist), so T_cam_rig of
  // camera i becomes T_i0 exp(delay twist), and the rig's pose refers to the time of the rig. Cameras with a rolling
  // shutter move with the same velocity while their rows are exposed. `twist` (rad/s and m/s)
  // is defined by T_rig_world(t + dt) = exp(dt twist) T_rig_world(t). Cheap.
  Rig moving(std::span<const double> delay_s, const geometry::Vector6d& twist) const;

 private:
  static constexpr double kMinOverlap = 0.05;  // fraction of the image; a smaller overlap is ignored
  struct Calibration {
    std::vector<RigCamera> cameras;
    std::vector<double> overlap;          // (N, N) row-major
    std::vector<double> min_axis_cosine;  // per camera
  };
  const CameraMove* move_at(std::size_t i, TimeNs time_ns) const;  // the last one of a camera until a time, or null
  std::vector<double> measured_overlap(const std::vector<RigCamera>& cameras) const;

  std::shared_ptr<const Calibration> calibration_;
  std::shared_ptr<const std::vector<CameraMove>> moves_;  // null: none
  std::vector<geometry::SE3> T_cam_rig_, T_rig_cam_;
  static const Shutter kGlobalShutter;
  std::vector<Shutter> shutters_;  // per camera; empty if none is rolling
};

}  // namespace bslam::camera
