#include "session/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "session/late_camera_json.h"

namespace bslam::session {

namespace {

using nlohmann::ordered_json;

// Rounds to the given number of decimals, since further digits are noise. NaN becomes null.
ordered_json rounded(double value, int decimals) {
  if (!std::isfinite(value)) return nullptr;
  const double unit = std::pow(10.0, decimals);
  return std::round(value * unit) / unit;
}

ordered_json seconds(double value_s) { return rounded(value_s, 6); }

double mean_of(double sum, std::size_t count) {
  return count > 0 ? sum / static_cast<double>(count) : std::numeric_limits<double>::quiet_NaN();
}

ordered_json frames_json(const RunRecord& record) {
  ordered_json intervals = ordered_json::array();
  for (const LostInterval& interval : lost_intervals(record)) {
    intervals.push_back(
        {{"from", seconds(interval.from_s)}, {"to", seconds(interval.to_s)}, {"reason", interval.reason}});
  }
  ordered_json reduced = ordered_json::array();
  for (const ReducedInterval& interval : reduced_intervals(record)) {
    reduced.push_back({{"from", seconds(interval.from_s)}, {"to", seconds(interval.to_s)}, {"level", interval.level}});
  }
  ordered_json contested = ordered_json::array();
  for (const ContestedInterval& interval : contested_intervals(record)) {
    contested.push_back(
        {{"from", seconds(interval.from_s)}, {"to", seconds(interval.to_s)}, {"frames", interval.frames}});
  }
  return {{"input", record.frames.size()},
          {"tracked", count(record, FrameOutcome::kTracked)},
          {"lost", count(record, FrameOutcome::kLost)},
          {"dropped", count(record, FrameOutcome::kDropped)},
          {"in_loaded_map", record.map.loaded ? ordered_json(frames_in_loaded_map(record)) : ordered_json()},
          {"lost_intervals", intervals},
          {"reduced_work", reduced},
          {"contested_intervals", contested}};
}

ordered_json extrinsics_json(const std::optional<ExtrinsicsRecord>& e) {
  if (!e) return nullptr;
  const auto known = [](double deviation, int digits, bool observed) {
    return observed ? ordered_json(rounded(deviation, digits)) : ordered_json();
  };
  return {{"change_deg", rounded(e->change_deg, 4)},
          {"std_deg", known(e->std_deg, 4, e->rotation_observed)},
          {"change_mm", rounded(e->change_mm, 2)},
          {"std_mm", known(e->std_mm, 2, e->translation_observed)},
          {"observed", {{"rotation", e->rotation_observed}, {"translation", e->translation_observed}}},
          {"suspect", e->suspect},
          {"refined", e->refined}};
}

ordered_json reprojection_json(const RunRecord& record, std::size_t camera) {
  const calibration::ImageResiduals& residuals = record.cameras[camera].residuals;
  const auto share = inlier_share(record, camera);
  return {{"rms_px", residuals.observations > 0 ? rounded(residuals.rms_px, 3) : ordered_json()},
          {"observations", residuals.observations},
          {"inlier_share", share ? rounded(*share, 4) : ordered_json()}};
}

ordered_json cameras_json(const RunRecord& record) {
  ordered_json cameras = ordered_json::array();
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const CameraRecord& camera = record.cameras[c];
    ordered_json states = ordered_json::array();
    for (const CameraInterval& interval : camera.states) {
      states.push_back({{"state", tracking::describe(interval.status.state)},
                        {"reason", tracking::describe(interval.status.reason)},
                        {"from", seconds(interval.from_s)},
                        {"to", seconds(interval.to_s)}});
    }
    cameras.push_back({{"name", camera.name},
                       {"images", camera.images},
                       {"skipped", camera.skipped},
                       {"states", states},
                       {"reprojection", reprojection_json(record, c)},
                       {"extrinsics", extrinsics_json(camera.extrinsics)}});
  }
  return cameras;
}

ordered_json calibrated_camera_json(const std::string& name, const calibration::CameraRefinement& camera) {
  ordered_json intrinsics = ordered_json::object();
  for (const calibration::ParameterRefinement& p : camera.intrinsics)
    intrinsics[p.name] = {{"change", rounded(p.change, 7)}, {"std", p.observed ? rounded(p.std, 7) : ordered_json()}};
  const auto known = [](double deviation, bool observed) {
    return observed ? ordered_json(rounded(deviation, 4)) : ordered_json();
  };
  return {{"name", name},
          {"intrinsics", intrinsics},
          {"rotation_deg", rounded(camera.change_deg, 4)},
          {"rotation_std_deg", known(camera.std_deg, camera.rotation_observed())},
          {"translation_mm", rounded(camera.change_mm, 3)},
          {"translation_std_mm", known(camera.std_mm, camera.translation_observed())},
          {"time_offset_ms", rounded(camera.time_offset.change_ms, 4)},
          {"time_offset_std_ms", known(camera.time_offset.std_ms, camera.time_offset.refined)},
          {"readout_ms", rounded(camera.readout.change_ms, 4)},
          {"readout_std_ms", known(camera.readout.std_ms, camera.readout.refined)}};
}

ordered_json late_json(const RunRecord& record) {
  const auto& late = record.calibration.late;
  if (!late) return nullptr;
  return late_camera_json(
      {{"name", record.cameras[late->camera].name}, {"reference", record.cameras[late->reference].name}}, *late);
}

ordered_json names_of(const RunRecord& record, std::span<const std::size_t> cameras) {
  ordered_json names = ordered_json::array();
  for (const std::size_t c : cameras) names.push_back(record.cameras[c].name);
  return names;
}

ordered_json unsteady_json(const RunRecord& record) {
  const auto& camera = record.calibration.estimate.unsteady;
  return camera && *camera < record.cameras.size() ? ordered_json(record.cameras[*camera].name) : nullptr;
}

ordered_json time_jump_json(const RunRecord& record) {
  const auto& jump = record.calibration.estimate.jump;
  if (!jump || jump->camera >= record.cameras.size()) return nullptr;
  return {{"camera", record.cameras[jump->camera].name},
          {"at", seconds(record.calibration.jump_at_s)},
          {"taken", jump->shift_s > 0 ? "later" : "earlier"}};
}

ordered_json calibration_json(const RunRecord& record) {
  const calibration::RigRefinement& estimate = record.calibration.estimate;
  ordered_json cameras = ordered_json::array();
  for (std::size_t c = 0; c < estimate.cameras.size() && c < record.cameras.size(); ++c)
    cameras.push_back(calibrated_camera_json(record.cameras[c].name, estimate.cameras[c]));
  ordered_json pairs = ordered_json::array();
  for (const calibration::CameraPair& pair : record.calibration.pairs) {
    pairs.push_back(
        {{"cameras", {record.cameras[pair.first].name, record.cameras[pair.second].name}},
         {"overlap", rounded(pair.overlap, 3)},
         {"matched_share", pair.keyframes > 0 ? rounded(pair.matched_share(), 5) : ordered_json()},
         {"contradicted", pair.contradicted},
         {"evidence", pair.evidence ? ordered_json(calibration::describe_pair(*pair.evidence)) : ordered_json()}});
  }
  ordered_json moves = ordered_json::array();
  for (const CameraMoveRecord& move : record.calibration.moves) {
    if (move.camera >= record.cameras.size()) continue;
    moves.push_back({{"camera", record.cameras[move.camera].name},
                     {"at", seconds(move.at_s)},
                     {"rotation_deg", rounded(move.change_deg, 4)},
                     {"rotation_std_deg", rounded(move.std_deg, 4)},
                     {"translation_mm", rounded(move.change_mm, 3)},
                     {"translation_std_mm", rounded(move.std_mm, 3)}});
  }
  return {{"verdict", calibration::verdict_name(record.calibration.verdict())},
          {"excess_error", estimate.done ? rounded(estimate.excess_error, 4) : ordered_json()},
          {"excess_bound", rounded(record.calibration.excess_bound, 4)},
          {"pairs", pairs},
          {"disagreeing", names_of(record, record.calibration.disagreeing)},
          {"unexplained", names_of(record, record.calibration.unexplained)},
          {"late_camera", late_json(record)},
          {"moves", moves},
          {"time_jump", time_jump_json(record)},
          {"unsteady", unsteady_json(record)},
          {"refined", record.calibration.refined},
          {"cameras", cameras}};
}

ordered_json features_json(const RunRecord& record) {
  double keypoints = 0.0, unique = 0.0, monocular = 0.0, matched = 0.0;
  std::size_t images = 0, frames = 0;
  for (const RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    ++frames;
    unique += frame.record->unique;
    monocular += frame.record->monocular;
    matched += frame.record->matched;
    for (std::size_t c = 0; c < frame.record->images.size(); ++c) {
      if (frame.record->images[c] != image::ImageState::kPresent) continue;
      ++images;
      keypoints += frame.record->final_result().cameras[c].keypoints;
    }
  }
  return {{"keypoints_per_image", rounded(mean_of(keypoints, images), 2)},
          {"unique", rounded(mean_of(unique, frames), 2)},
          {"monocular", rounded(mean_of(monocular, frames), 2)},
          {"matched", rounded(mean_of(matched, frames), 2)}};
}

ordered_json events_json(const std::vector<PlaceEvent>& events) {
  ordered_json list = ordered_json::array();
  for (const PlaceEvent& event : events) {
    list.push_back({{"at", seconds(event.at_s)}, {"with", seconds(event.with_s)}, {"inliers", event.inliers}});
  }
  return list;
}

ordered_json submaps_json(const std::vector<SubmapRecord>& submaps) {
  ordered_json list = ordered_json::array();
  for (const SubmapRecord& submap : submaps) {
    list.push_back({{"frames", submap.frames},
                    {"from", seconds(submap.from_s)},
                    {"to", seconds(submap.to_s)},
                    {"loaded", submap.loaded},
                    {"trajectory", submap.trajectory}});
  }
  return list;
}

ordered_json durations_json(const std::vector<double>& durations_ms) {
  const DurationStatistics s = duration_statistics(durations_ms);
  return {{"median", rounded(s.median, 3)}, {"p95", rounded(s.p95, 3)}, {"max", rounded(s.max, 3)}};
}

ordered_json time_json(const RunRecord& record) {
  std::vector<double> frame_ms;
  for (const RunFrame& frame : record.frames) {
    if (frame.record) frame_ms.push_back(frame.record->frame_ms);
  }
  ordered_json stages = ordered_json::object();
  for (const StageSeries& series : record.stages) {
    std::vector<double> durations;
    for (const StageSample& sample : series.samples) durations.push_back(sample.ms);
    stages[series.name] = durations_json(durations);
    stages[series.name]["count"] = durations.size();
    stages[series.name]["total"] = rounded(std::accumulate(durations.begin(), durations.end(), 0.0), 3);
  }
  return {{"start_up_s", rounded(record.start_up_s, 3)},
          {"wall_s", rounded(record.wall_s, 3)},
          {"cpu_s", record.cpu_s ? rounded(*record.cpu_s, 3) : ordered_json()},
          {"frame_ms", durations_json(frame_ms)},
          {"stages_ms", stages}};
}

ordered_json work_json(const RunRecord& record) {
  const WorkRecord& work = record.work;
  return {{"frames", record.frames.size() - static_cast<std::size_t>(count(record, FrameOutcome::kDropped))},
          {"keyframes", record.map.keyframes},
          {"landmarks", record.map.landmarks},
          {"observations", record.map.observations},
          {"images_extracted", work.images},
          {"features_extracted", work.keypoints},
          {"solver_steps", work.solver_steps},
          {"allocations", work.allocations ? ordered_json(*work.allocations) : ordered_json()}};
}

ordered_json memory_json(const RunRecord& record) {
  const auto mb = [](const std::optional<double>& value, int digits) {
    return value ? rounded(*value, digits) : ordered_json();
  };
  ordered_json out = {{"peak_mb", mb(record.peak_memory_mb, 1)}};
  if (record.memory.parts.empty()) return out;
  out["resident_mb"] = mb(record.memory.resident_mb, 3);
  ordered_json parts = ordered_json::array();
  for (const MemoryPart& part : record.memory.parts)
    parts.push_back({{"part", part.name}, {"mb", rounded(part.mb, 3)}, {"largest_mb", mb(part.largest_mb, 3)}});
  out["report"] = std::move(parts);
  return out;
}

}  // namespace

DurationStatistics duration_statistics(std::vector<double> durations_ms) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (durations_ms.empty()) return {kNone, kNone, kNone, 0};
  std::ranges::sort(durations_ms);
  const auto quantile = [&](double share) {
    const double position = share * static_cast<double>(durations_ms.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, durations_ms.size() - 1);
    return std::lerp(durations_ms[below], durations_ms[above], position - static_cast<double>(below));
  };
  return {quantile(0.5), quantile(0.95), durations_ms.back(), durations_ms.size()};
}

ordered_json summary_json(const RunRecord& record) {
  return {{"schema", 1},
          {"version", record.version},
          {"complete", record.complete},
          {"data", record.data},
          {"mode", record.mode},
          {"seed", record.seed},
          {"cameras_used", record.cameras_used},
          {"frames", frames_json(record)},
          {"cameras", cameras_json(record)},
          {"calibration", calibration_json(record)},
          {"features", features_json(record)},
          {"map",
           {{"keyframes", record.map.keyframes},
            {"landmarks", record.map.landmarks},
            {"observations", record.map.observations},
            {"scale", record.map.scale},
            {"scale_std", record.map.scale_deviation ? rounded(*record.map.scale_deviation, 4) : ordered_json(nullptr)},
            {"loaded", record.map.loaded}}},
          {"loops", events_json(record.loops)},
          {"relocalisations", events_json(record.relocalisations)},
          {"maps_started", record.maps_started},
          {"parts", submaps_json(record.submaps)},  // the submaps; the key is kept for compatibility
          {"time", time_json(record)},
          {"work", work_json(record)},
          {"memory", memory_json(record)},
          {"warnings", record.warnings}};
}

std::string summary_text(const RunRecord& record) {
  return summary_json(record).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace bslam::session
