// A simulated recording: which pictures there are, what each of them shows, and the pictures themselves.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "base/timestamp.h"
#include "camera/rig.h"
#include "simulator/faults.h"
#include "simulator/renderer.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

struct RecordingOptions {
  double duration_s = 20.0;
  double rate_hz = 20.0;
  double exposure_s = 0.005;
  TimeNs start_ns = 1'000'000'000;  // stamp of the first images; the trajectory begins there
  std::vector<Fault> faults = {};   // where two hit one picture, the later one in the list holds
};

// One picture of one camera.
struct Shot {
  std::size_t frame = 0, camera = 0;
  TimeNs stamp_ns = 0;          // as recorded
  double scene_time_s = 0;      // middle of the exposure, seconds of the trajectory
  std::uint64_t noise_key = 0;  // equal keys and scenes give equal bytes
  double exposure = 1.0;        // light against the usual
  double blur_px = 0.0;         // standard deviation
  bool written = true;          // false: the picture is missing
  std::optional<FaultType> fault;
};

// Stamp of frame k: start + k / rate, rounded to nanoseconds. There are floor(duration * rate), at least one.
TimeNs frame_stamp(const RecordingOptions& options, std::size_t frame);
std::size_t frame_count(const RecordingOptions& options);

// Every shot of the recording, missing ones included, frame by frame and camera by camera. A camera's time offset moves
// what its picture shows: true time = stamp + offset. Faults name cameras of the rig.
std::vector<Shot> plan_shots(const camera::Rig& rig, const RecordingOptions& options);

// Takes the pictures.
class Recorder {
 public:
  // The world must outlive the recorder. Prepares the cameras with the threads of `pool`.
  Recorder(const World& world, camera::Rig rig, synthetic::Trajectory trajectory, const ImagingOptions& imaging,
           double exposure_s, ThreadPool& pool);

  // Depends on nothing but the shot. Safe to call from many threads.
  image::Image picture(const Shot& shot) const;

  // T_world_cam of a camera at a time of the trajectory.
  geometry::SE3 T_world_cam(std::size_t camera, double time_s) const {
    return trajectory_.T_world_body(time_s) * rig_.body_from_cam(camera);
  }
  const camera::Rig& rig() const { return rig_; }
  const synthetic::Trajectory& trajectory() const { return trajectory_; }

 private:
  camera::Rig rig_;
  synthetic::Trajectory trajectory_;
  double exposure_s_;
  std::vector<std::optional<Renderer>> renderers_;  // one per camera
};

}  // namespace bslam::simulator
