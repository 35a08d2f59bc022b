#include "live_view/live_record.h"

#include <algorithm>

#include "session/record_builder.h"
#include "session/report_data.h"

namespace bslam::live_view {
namespace {

constexpr session::ReportLimits kLimits{.points = 30'000, .poses = 3'000};

}  // namespace

LiveRecord::LiveRecord(const dataset::Dataset& dataset, const system::Config& config, std::size_t loaded_keyframes)
    : dataset_(dataset), loaded_keyframes_(loaded_keyframes), frames_(dataset.rig.size()) {
  start_.version = BSLAM_VERSION;
  start_.data = dataset.name;
  start_.mode = session::mode_name(config.mode);
  start_.seed = static_cast<std::uint64_t>(config.seed);
  start_.cameras_used = dataset.cameras_used;
  start_.cameras.resize(dataset.rig.size());
  for (std::size_t c = 0; c < start_.cameras.size(); ++c) start_.cameras[c].name = dataset.rig.camera(c).name;
}

void LiveRecord::append(FrameLog&& frames) { frames_.append(std::move(frames)); }

// The record of all frames so far.
session::RunRecord LiveRecord::record_of_frames() const {
  session::RunRecord record = start_;
  record.frames.reserve(frames_.size());
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const double time_s = seconds(frames_.time_ns(i));
    session::add_stage_sample(record, "read", session::StageThread::kBackground,
                              {time_s, static_cast<double>(frames_.read_ms(i))});
    for (const FrameLog::Stage& s : frames_.stages(i))
      session::add_stage_sample(record, s.name, session::StageThread::kCaller, {time_s, static_cast<double>(s.ms)});
    const session::RunFrame& frame = record.frames.emplace_back(session::RunFrame{time_s, frames_.record(i)});
    if (!frame.record) continue;
    for (std::size_t c = 0; c < record.cameras.size(); ++c) {
      record.cameras[c].images += frame.record->images[c] == image::ImageState::kPresent;
      record.cameras[c].skipped += frame.record->images[c] == image::ImageState::kDamaged;
    }
  }
  for (std::size_t c = 0; c < record.cameras.size(); ++c)
    record.cameras[c].states = session::camera_intervals(record.frames, c);
  for (const FrameLog::Relocalised& r : frames_.relocalised())
    record.relocalisations.push_back({seconds(r.time_ns), seconds(r.with_ns), r.inliers});
  return record;
}

// The poses of the frames in the map, one path per submap in the order of their roots, so that a submap keeps its place
// in the list until it is merged.
std::vector<system::SubmapTrajectory> LiveRecord::paths(const map::BundledMap& map) const {
  std::vector<system::SubmapTrajectory> out;
  const std::size_t stride = session::report_stride(frames_.size(), kLimits.poses);
  for (std::size_t i = 0; i < frames_.size(); i += stride) {
    if (!frames_.tracked(i)) continue;
    const map::AnchoredPose pose = frames_.pose(i);
    const auto T_rig_world = pose.resolve(map);
    if (!T_rig_world) continue;
    const KeyframeId root = map.root_of(pose.reference);
    auto path = std::ranges::find(out, root, &system::SubmapTrajectory::root);
    if (path == out.end()) path = out.insert(out.end(), {root, {}, root.index() < loaded_keyframes_});
    path->poses.push_back({frames_.time_ns(i), T_rig_world->inverse()});
  }
  std::ranges::sort(out, {}, &system::SubmapTrajectory::root);
  return out;
}

nlohmann::ordered_json LiveRecord::run_json(const map::BundledMap& map, const camera::Rig& rig,
                                            const StageResults& results,
                                            const std::optional<geometry::UpAxis>& up) const {
  const std::vector<system::SubmapTrajectory> submaps = paths(map);
  session::RunRecord record = record_of_frames();
  for (const system::StageRecord& run : results.runs) session::add_stage_run(record, run, dataset_.first_time_ns);
  for (const system::LoopRecord& loop : results.loops)
    record.loops.push_back({seconds(loop.time_ns), seconds(loop.with_time_ns), loop.closure.inliers});
  record.maps_started = results.maps_started;
  record.map = session::map_record(map, loaded_keyframes_ > 0);
  for (const system::SubmapTrajectory& s : submaps) {
    record.submaps.push_back({static_cast<std::int64_t>(s.poses.size()),
                              seconds(s.poses.front().time_ns),
                              seconds(s.poses.back().time_ns),
                              {},
                              s.loaded});
  }
  return session::run_json(record, map, rig, submaps, dataset_.first_time_ns, kLimits, up);
}

}  // namespace bslam::live_view
