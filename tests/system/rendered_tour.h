// A short tour through the built-in world, rendered with a low resolution for the system tests. A ring of eight
// cameras; rigs with fewer cameras contain the first ones, of which the first two look ahead side by side.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "evaluation/trajectory_error.h"
#include "image/image_bundle.h"
#include "simulator/recorder.h"
#include "simulator/tour.h"
#include "synthetic/rigs.h"
#include "system/system.h"

namespace bslam::system {

class RenderedTour {
 public:
  using Motion = std::function<synthetic::Trajectory(const simulator::Building&, double duration_s)>;

  RenderedTour(int cameras, std::size_t frames, TimeNs late_ns = 0)
      : RenderedTour(late(first_cameras(cameras), late_ns), frames) {}

  RenderedTour(camera::Rig rig, std::size_t frames)
      : RenderedTour(std::move(rig), frames, [](const auto& building, double duration_s) {
          return simulator::make_tour(building, {.duration_s = duration_s, .seed = 3});
        }) {}

  // `late_ns`: delay of the images of camera 2 and the following ones.
  RenderedTour(int cameras, std::size_t frames, const Motion& motion, TimeNs late_ns = 0)
      : RenderedTour(late(first_cameras(cameras), late_ns), frames, motion) {}

  RenderedTour(camera::Rig rig, std::size_t frames, const Motion& motion)
      : rig_(std::move(rig)), rig_truth_(rig_.size()) {
    ThreadPool pool(2);
    const simulator::World world(simulator::make_building(3), {.texel = 0.02, .light_texel = 0.8, .ambient_rays = 2},
                                 pool);
    const simulator::RecordingOptions options{.duration_s = static_cast<double>(frames) / kRateHz, .rate_hz = kRateHz};
    const simulator::Recorder recorder(world, rig_, motion(world.building(), options.duration_s), {}, 0.002, pool);
    const std::vector<simulator::Shot> shots = simulator::plan_shots(rig_, options);
    frames_.resize(frames);
    for (std::size_t k = 0; k < frames; ++k) {
      frames_[k].id = FrameId(k);
      frames_[k].time_ns = simulator::frame_stamp(options, k);
      frames_[k].images.resize(rig_.size());
    }
    pool.for_each(shots.size(), [&](std::size_t i) {
      const simulator::Shot& shot = shots[i];
      const TimeNs time_ns = shot.stamp_ns + rig_.camera(shot.camera).time_offset_ns;
      frames_[shot.frame].images[shot.camera] = {image::ImageState::kPresent, time_ns, recorder.render(shot)};
    });
    for (const simulator::Shot& shot : shots) {
      rig_truth_[shot.camera].push_back({shot.stamp_ns, recorder.T_world_cam(0, shot.scene_time_s)});
    }
  }

  const camera::Rig& rig() const { return rig_; }
  const std::vector<image::ImageBundle>& frames() const { return frames_; }
  const evaluation::Trajectory& truth() const { return rig_truth_[0]; }  // of camera 0
  // Pose of the rig at the capture time of camera c, stored with the time of the frame.
  const evaluation::Trajectory& rig_truth(std::size_t c) const { return rig_truth_[c]; }

  // The same recording with fewer cameras.
  camera::Rig rig_of(int cameras) const { return rig_.subset(camera_list(cameras)); }
  image::ImageBundle frame_of(std::size_t k, int cameras) const {
    image::ImageBundle out = frames_[k];
    out.images.resize(static_cast<std::size_t>(cameras));
    return out;
  }

  // The recording repeated with ids from `first_id`: frame k, and the truth of all frames.
  image::ImageBundle replayed(std::size_t k, std::size_t first_id) const {
    image::ImageBundle out = frames_[k];
    out.id = FrameId(first_id + k);
    out.time_ns += shift_ns(first_id);
    for (image::CameraImage& i : out.images) i.time_ns += shift_ns(first_id);
    return out;
  }
  evaluation::Trajectory replayed_truth(std::size_t first_id) const {
    evaluation::Trajectory out = truth();
    for (evaluation::TimedPose& p : out) p.time_ns += shift_ns(first_id);
    return out;
  }

  static constexpr double kRateHz = 15;

 private:
  static TimeNs shift_ns(std::size_t frames) { return from_seconds(static_cast<double>(frames) / kRateHz); }
  static std::vector<int> camera_list(int cameras) {
    std::vector<int> list(static_cast<std::size_t>(cameras));
    std::iota(list.begin(), list.end(), 0);
    return list;
  }
  static camera::Rig first_cameras(int cameras) { return synthetic::ring_rig(8, 320).subset(camera_list(cameras)); }

  static camera::Rig late(const camera::Rig& rig, TimeNs late_ns) {
    std::vector<camera::RigCamera> cameras;
    for (std::size_t c = 0; c < rig.size(); ++c) {
      cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
      if (c >= 2) cameras.back().camera.time_offset_ns = late_ns;
    }
    return camera::Rig(std::move(cameras));
  }

  camera::Rig rig_;
  std::vector<image::ImageBundle> frames_;
  std::vector<evaluation::Trajectory> rig_truth_;  // by camera
};

// The tour of the first cameras, rendered once in a process.
inline const RenderedTour& rendered_tour(int cameras, std::size_t frames) {
  static std::map<std::pair<int, std::size_t>, const RenderedTour> tours;
  return tours.try_emplace({cameras, frames}, cameras, frames).first->second;
}

// Another place with similar texture: images mirrored horizontally.
inline void mirror(image::CameraImage& image) {
  for (int y = 0; y < image.image.height(); ++y)
    std::reverse(image.image.row(y), image.image.row(y) + image.image.width());
}

inline void blacken(image::CameraImage& input) {
  for (int y = 0; y < input.image.height(); ++y) {
    std::fill(input.image.row(y), input.image.row(y) + input.image.width(), std::uint8_t{0});
  }
}

inline void make_absent(image::CameraImage& input, image::ImageState state) {
  input.state = state;
  input.image = {};
}

// Options for images of 320 x 204.
inline Config small_config(execution::Mode mode, int threads = 2) {
  Config config;
  config.mode = mode;
  config.execution.threads = threads;
  config.features.per_image = 500;
  return config;
}

// Processes a valid frame.
inline FrameRecord must_process(System& system, const image::ImageBundle& images) {
  const auto record = system.process(images);
  EXPECT_TRUE(record.ok());
  return record.value();
}

inline std::size_t tracked_frames(const System& system) {
  std::size_t n = 0;
  for (const FrameRecord& r : system.frames()) n += r.result.status == tracking::TrackStatus::kTracking;
  return n;
}

// Root mean square position error in metres after alignment.
inline double ate_m(const evaluation::Trajectory& estimate, const evaluation::Trajectory& truth,
                    evaluation::AlignMode align = evaluation::AlignMode::kSe3) {
  const auto result = evaluation::evaluate(estimate, truth, {.align = align});
  return result ? result->ate.rmse : std::numeric_limits<double>::infinity();
}

// Poses in the longest submap, final and live.
inline evaluation::Trajectory final_poses(const System& system) {
  const std::vector<SubmapTrajectory> submaps = system.trajectories();
  return submaps.empty() ? evaluation::Trajectory() : submaps.front().poses;
}
inline evaluation::Trajectory live_poses(const System& system) {
  const std::vector<SubmapTrajectory> submaps = system.live_trajectories();
  return submaps.empty() ? evaluation::Trajectory() : submaps.front().poses;
}

inline bool identical(const evaluation::Trajectory& a, const evaluation::Trajectory& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].time_ns != b[i].time_ns || a[i].T_world_frame.translation() != b[i].T_world_frame.translation() ||
        a[i].T_world_frame.rotation().coeffs() != b[i].T_world_frame.rotation().coeffs()) {
      return false;
    }
  }
  return true;
}

inline bool identical(const std::vector<SubmapTrajectory>& a, const std::vector<SubmapTrajectory>& b) {
  return std::ranges::equal(a, b, [](const SubmapTrajectory& x, const SubmapTrajectory& y) {
    return x.root == y.root && identical(x.poses, y.poses);
  });
}

}  // namespace bslam::system
