// Simulated recordings: the list of images and the conditions under which they are taken, and the images themselves.
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
  TimeNs start_ns = 1'000'000'000;  // time stamp of the first images, at which the trajectory begins
  std::vector<Fault> faults = {};   // if several affect an image, the last one in the list applies
};

// One image of one camera.
struct Shot {
  std::size_t frame = 0, camera = 0;
  TimeNs stamp_ns = 0;          // recorded time stamp
  double scene_time_s = 0;      // time of the trajectory in the middle of the exposure, seconds
  std::uint64_t noise_key = 0;  // equal keys and scenes give equal images
  double exposure = 1.0;        // factor on the light
  double blur_px = 0.0;         // standard deviation of the blur
  bool written = true;          // false: the image is missing
  std::optional<FaultType> fault;
};

// Returns the time stamp of frame k: start + k / rate, rounded to nanoseconds. The number of frames is floor(duration *
// rate), but at least one.
TimeNs frame_stamp(const RecordingOptions& options, std::size_t frame);
std::size_t frame_count(const RecordingOptions& options);

// Returns all shots of the recording including missing ones, ordered by frame, then by camera. The time offset of a
// camera shifts the content of its images: true time = stamp + offset. Faults must refer to cameras of the rig.
std::vector<Shot> plan_shots(const camera::Rig& rig, const RecordingOptions& options);

// Renders the images.
class Recorder {
 public:
  // The world must outlive the recorder. `pool` is used to prepare the cameras.
  Recorder(const World& world, camera::Rig rig, synthetic::Trajectory trajectory, const ImagingOptions& imaging,
           double exposure_s, ThreadPool& pool);

  // Renders an image, with a rolling shutter if the camera has one. The result depends on the shot only. May be called
  // from several threads.
  image::Image render(const Shot& shot) const;

  // Returns T_world_cam of a camera at a time of the trajectory.
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
