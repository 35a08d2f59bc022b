#include "live_view/live_record.h"

#include <algorithm>

#include "session/record_builder.h"
#include "session/report_data.h"

namespace bslam::live_view {
namespace {

constexpr session::ReportLimits kLimits{.points = 30'000, .poses = 3'000};

}  // namespace

LiveRecord::LiveRecord(const dataset::Dataset& dataset, const system::Config& config, std::size_t loaded_keyframes)
    : dataset_(dataset), loaded_keyframes_(loaded_keyframes) {
  record_.version = BSLAM_VERSION;
  record_.data = dataset.name;
  record_.mode = session::mode_name(config.mode);
  record_.seed = static_cast<std::uint64_t>(config.seed);
  record_.cameras_used = dataset.cameras_used;
  record_.cameras.resize(dataset.rig.size());
  for (std::size_t c = 0; c < record_.cameras.size(); ++c) record_.cameras[c].name = dataset.rig.camera(c).name;
}

void LiveRecord::add(InputFrame&& input) {
  session::RunFrame& frame = record_.frames.emplace_back(session::RunFrame{seconds(input.time_ns), {}});
  record_.stages = {};
  std::swap(record_.stages, caller_stages_);
  session::add_stage_sample(record_, "read", session::StageThread::kBackground, {frame.time_s, input.read_ms});
  if (input.record) {
    for (const tracking::StageTime& s : input.record->stages)
      session::add_stage_sample(record_, s.stage, session::StageThread::kCaller, {frame.time_s, s.ms});
    if (input.record->relocalisation) {
      record_.relocalisations.push_back(
          {frame.time_s, seconds(input.relocalised_with_ns), input.record->relocalisation->inliers});
    }
    if (input.record->map_withdrawn) withdraw_map();
    for (std::size_t c = 0; c < record_.cameras.size(); ++c) {
      const image::ImageState image = input.record->images[c];
      record_.cameras[c].images += image == image::ImageState::kPresent;
      record_.cameras[c].skipped += image == image::ImageState::kDamaged;
    }
  }
  std::swap(record_.stages, caller_stages_);
  frame.record = std::move(input.record);
}

// Removes the poses of a wrong initialisation together with its map.
void LiveRecord::withdraw_map() {
  for (session::RunFrame& frame : record_.frames) {
    if (frame.outcome() != session::FrameOutcome::kTracked) continue;
    frame.record->result.status = tracking::TrackStatus::kLost;
    frame.record->result.reason = tracking::LostReason::kNotStarted;
    frame.record->keyframe = false;
  }
}

// The poses of the frames in the map, one path per submap in the order of their roots, so that a submap keeps its place
// in the list until it is merged.
std::vector<system::SubmapTrajectory> LiveRecord::paths(const map::BundledMap& map) const {
  std::vector<system::SubmapTrajectory> out;
  const std::size_t stride = session::report_stride(record_.frames.size(), kLimits.poses);
  for (std::size_t i = 0; i < record_.frames.size(); i += stride) {
    if (record_.frames[i].outcome() != session::FrameOutcome::kTracked) continue;
    const tracking::TrackResult& result = record_.frames[i].record->result;
    const auto T_rig_world = result.anchored.resolve(map);
    if (!T_rig_world) continue;
    const KeyframeId root = map.root_of(result.anchored.reference);
    auto path = std::ranges::find(out, root, &system::SubmapTrajectory::root);
    if (path == out.end()) path = out.insert(out.end(), {root, {}, root.index() < loaded_keyframes_});
    path->poses.push_back({result.time_ns, T_rig_world->inverse()});
  }
  std::ranges::sort(out, {}, &system::SubmapTrajectory::root);
  return out;
}

nlohmann::ordered_json LiveRecord::run_json(const map::BundledMap& map, const camera::Rig& rig,
                                            const StageResults& results, const std::optional<geometry::UpAxis>& up) {
  const std::vector<system::SubmapTrajectory> submaps = paths(map);
  record_.stages = caller_stages_;
  for (const system::StageRecord& run : results.runs) session::add_stage_run(record_, run, dataset_.first_time_ns);
  record_.loops.clear();
  for (const system::LoopRecord& loop : results.loops)
    record_.loops.push_back({seconds(loop.time_ns), seconds(loop.with_time_ns), loop.closure.inliers});
  record_.maps_started = results.maps_started;
  record_.map = session::map_record(map, loaded_keyframes_ > 0);
  record_.submaps.clear();
  for (const system::SubmapTrajectory& s : submaps) {
    record_.submaps.push_back({static_cast<std::int64_t>(s.poses.size()),
                               seconds(s.poses.front().time_ns),
                               seconds(s.poses.back().time_ns),
                               {},
                               s.loaded});
  }
  for (std::size_t c = 0; c < record_.cameras.size(); ++c)
    record_.cameras[c].states = session::camera_intervals(record_.frames, c);
  return session::run_json(record_, map, rig, submaps, dataset_.first_time_ns, kLimits, up);
}

}  // namespace bslam::live_view
