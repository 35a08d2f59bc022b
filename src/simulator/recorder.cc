#include "simulator/recorder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/assert.h"

namespace bslam::simulator {
namespace {

constexpr double kBlurPixels = 5.0;     // standard deviation of the blur of a smeared lens
constexpr double kOverExposure = 14.0;  // factor on the light, which saturates most pixels

// The last fault in the list that affects a camera at a time, or null.
const Fault* fault_at(const std::vector<Fault>& faults, std::size_t camera, double time_s) {
  for (auto fault = faults.rbegin(); fault != faults.rend(); ++fault) {
    const bool hit =
        std::find(fault->cameras.begin(), fault->cameras.end(), static_cast<int>(camera)) != fault->cameras.end();
    if (hit && time_s >= fault->from_s && time_s < fault->to_s) return &*fault;
  }
  return nullptr;
}

// `last` is the previous shot of the same camera, or null.
void apply(const Fault& fault, const Shot* last, Shot& shot) {
  shot.fault = fault.type;
  switch (fault.type) {
    case FaultType::kBlack:
      shot.exposure = 0;
      break;
    case FaultType::kOverExposed:
      shot.exposure = kOverExposure;
      break;
    case FaultType::kDropped:
      shot.written = false;
      break;
    case FaultType::kDelayed:
      shot.scene_time_s = std::max(0.0, shot.scene_time_s - fault.delay_s);
      break;
    case FaultType::kBlurred:
      shot.blur_px = kBlurPixels;
      break;
    case FaultType::kFrozen:
      if (last == nullptr) break;
      shot.scene_time_s = last->scene_time_s;
      shot.noise_key = last->noise_key;
      shot.exposure = last->exposure;
      shot.blur_px = last->blur_px;
      break;
  }
}

// When a row of a rolling shutter is exposed, after the middle row.
double row_delay_s(const camera::Camera& camera, std::size_t y) {
  return camera.readout_s * (static_cast<double>(y) / std::max(1, camera.height - 1) - 0.5);
}

}  // namespace

TimeNs frame_stamp(const RecordingOptions& options, std::size_t frame) {
  return options.start_ns + from_seconds(static_cast<double>(frame) / options.rate_hz);
}

std::size_t frame_count(const RecordingOptions& options) {
  constexpr double kRounding = 1e-9;  // so that 0.3 s at 10 Hz are three frames despite rounding
  return std::max<std::size_t>(1, static_cast<std::size_t>(options.duration_s * options.rate_hz + kRounding));
}

std::vector<Shot> plan_shots(const camera::Rig& rig, const RecordingOptions& options) {
  BSLAM_ASSERT(options.duration_s > 0 && options.rate_hz > 0, "duration and rate must be positive");
  std::vector<Shot> shots;
  for (std::size_t frame = 0; frame < frame_count(options); ++frame) {
    for (std::size_t c = 0; c < rig.size(); ++c) {
      Shot shot;
      shot.frame = frame;
      shot.camera = c;
      shot.stamp_ns = frame_stamp(options, frame);
      shot.noise_key = frame * rig.size() + c;
      const double since_start = to_seconds(shot.stamp_ns - options.start_ns);
      shot.scene_time_s = since_start + to_seconds(rig.camera(c).time_offset_ns);
      const Shot* last = frame > 0 ? &shots[shots.size() - rig.size()] : nullptr;
      if (const Fault* fault = fault_at(options.faults, c, since_start)) apply(*fault, last, shot);
      shots.push_back(shot);
    }
  }
  return shots;
}

Recorder::Recorder(const World& world, camera::Rig rig, synthetic::Trajectory trajectory, const ImagingOptions& imaging,
                   double exposure_s, ThreadPool& pool)
    : rig_(std::move(rig)), trajectory_(std::move(trajectory)), exposure_s_(exposure_s), renderers_(rig_.size()) {
  pool.for_each(rig_.size(), [&](std::size_t c) { renderers_[c].emplace(world, rig_.camera(c), imaging); });
}

image::Image Recorder::render(const Shot& shot) const {
  const camera::Camera& camera = rig_.camera(shot.camera);
  std::vector<ExposurePoses> of_rows(camera.readout_s == 0 ? 1 : static_cast<std::size_t>(camera.height));
  for (std::size_t y = 0; y < of_rows.size(); ++y) {
    const double time_s = shot.scene_time_s + (of_rows.size() > 1 ? row_delay_s(camera, y) : 0.0);
    for (std::size_t k = 0; k < of_rows[y].size(); ++k) {
      const double fraction = (static_cast<double>(k) + 0.5) / static_cast<double>(of_rows[y].size()) - 0.5;
      of_rows[y][k] = T_world_cam(shot.camera, time_s + fraction * exposure_s_);
    }
  }
  return renderers_[shot.camera]->render(of_rows, shot.noise_key, shot.exposure, shot.blur_px);
}

}  // namespace bslam::simulator
