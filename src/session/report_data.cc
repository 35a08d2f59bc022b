#include "session/report_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/option_table.h"
#include "report/page.h"
#include "session/report_arrays.h"
#include "session/report_map.h"
#include "session/report_truth.h"
#include "session/summary.h"

namespace bslam::session {
namespace {

using nlohmann::ordered_json;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// The counts of a camera over the given frames, without value where it has no image. A frame that was tracked directly
// has no keypoints of its own.
ordered_json camera_counts(const std::vector<const RunFrame*>& frames, std::size_t camera) {
  std::vector<float> keypoints, matched, inliers;
  for (const RunFrame* frame : frames) {
    const bool seen = frame->record && camera < frame->record->images.size() &&
                      frame->record->images[camera] == image::ImageState::kPresent;
    const auto counts = seen ? frame->record->final_result().cameras[camera] : tracking::CameraCounts();
    keypoints.push_back(seen && !frame->record->direct ? static_cast<float>(counts.keypoints) : kNone);
    matched.push_back(seen ? static_cast<float>(counts.matched) : kNone);
    inliers.push_back(seen ? static_cast<float>(counts.inliers) : kNone);
  }
  return {{"keypoints", float_array(keypoints)}, {"matched", float_array(matched)}, {"inliers", float_array(inliers)}};
}

ordered_json frames_json(const RunRecord& record, std::size_t limit) {
  std::vector<const RunFrame*> frames;
  const std::size_t stride = report_stride(record.frames.size(), limit);
  for (std::size_t i = 0; i < record.frames.size(); i += stride) frames.push_back(&record.frames[i]);
  std::vector<float> time, ms;
  std::size_t direct = 0;
  for (const RunFrame* frame : frames) {
    time.push_back(static_cast<float>(frame->time_s));
    ms.push_back(frame->record ? static_cast<float>(frame->record->frame_ms) : kNone);
  }
  for (const RunFrame& frame : record.frames) direct += frame.record && frame.record->direct;
  ordered_json cameras = ordered_json::array();
  for (std::size_t c = 0; c < record.cameras.size(); ++c) cameras.push_back(camera_counts(frames, c));
  return {{"time", float_array(time)}, {"ms", float_array(ms)}, {"direct", direct}, {"cameras", cameras}};
}

// The longest calls of a stage are kept if there are too many.
ordered_json stage_json(const StageSeries& series, std::size_t limit) {
  std::vector<float> time, ms;
  double total_ms = 0;
  const std::size_t stride = report_stride(series.samples.size(), limit);
  for (std::size_t i = 0; i < series.samples.size(); ++i) {
    const StageSample& sample = series.samples[i];
    total_ms += sample.ms;
    if (i % stride == 0) {
      time.push_back(static_cast<float>(sample.time_s));
      ms.push_back(static_cast<float>(sample.ms));
    }
    ms.back() = std::max(ms.back(), static_cast<float>(sample.ms));
  }
  return {{"name", series.name},
          {"background", series.thread == StageThread::kBackground},
          {"total_ms", total_ms},
          {"time", float_array(time)},
          {"ms", float_array(ms)}};
}

ordered_json residuals_json(const calibration::ImageResiduals& residuals) {
  std::vector<float> mean, count;
  for (const calibration::ResidualCell& cell : residuals.cells) {
    mean.push_back(static_cast<float>(cell.mean_px.x()));
    mean.push_back(static_cast<float>(cell.mean_px.y()));
    count.push_back(static_cast<float>(cell.observations));
  }
  return {{"width", residuals.width},
          {"height", residuals.height},
          {"columns", calibration::ImageResiduals::kColumns},
          {"rows", calibration::ImageResiduals::kRows},
          {"observations", residuals.observations},
          {"rms_px", residuals.rms_px},
          {"mean_px", float_array(mean)},
          {"count", float_array(count)}};
}

}  // namespace

ordered_json settings_json(const system::Config& config) {
  system::Config copy = config, defaults;
  const OptionTable table(copy), default_table(defaults);
  ordered_json list = ordered_json::array();
  for (const Option& option : table.options()) {
    list.push_back({{"key", option.key},
                    {"value", value_text(option)},
                    {"default", value_text(*default_table.find(option.key))},
                    {"unit", option.unit},
                    {"help", option.help}});
  }
  return list;
}

ordered_json run_json(const RunRecord& record, const map::BundledMap& map, const camera::Rig& rig,
                      std::span<const system::SubmapTrajectory> paths, TimeNs first_time_ns, const ReportLimits& limits,
                      const std::optional<geometry::UpAxis>& up) {
  ordered_json stages = ordered_json::array(), residuals = ordered_json::array();
  for (const StageSeries& series : record.stages) stages.push_back(stage_json(series, limits.poses));
  for (const CameraRecord& camera : record.cameras) residuals.push_back(residuals_json(camera.residuals));
  return {{"schema", 1},
          {"summary", summary_json(record)},
          {"rig", report_rig(rig)},
          {"submaps", report_submaps(map, {paths, record.loops, first_time_ns, limits, up})},
          {"landmarks", map.num_landmarks()},
          {"frames", frames_json(record, limits.poses)},
          {"stages", std::move(stages)},
          {"residuals", std::move(residuals)}};
}

ordered_json report_json(const SessionResult& result, const system::Config& config, const ReportSource& source) {
  const RunRecord& record = result.record;
  const evaluation::Trajectory path =
      result.trajectories.empty() ? evaluation::Trajectory() : result.trajectories.front().poses;
  ordered_json json = run_json(record, *result.map, result.rig ? *result.rig : result.map->rig(), result.trajectories,
                               source.dataset.first_time_ns, {}, source.up);
  json["command"] = source.command;
  std::optional<TimeNs> last_ns;
  if (!record.complete && !record.frames.empty())
    last_ns = source.dataset.first_time_ns + from_seconds(record.frames.back().time_s);
  json["truth"] = report_truth(source.dataset, path, record.map.scale == "metric", last_ns);
  json["settings"] = settings_json(config);
  return json;
}

std::string report_text(const SessionResult& result, const system::Config& config, const ReportSource& source) {
  return report_json(result, config, source).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::string report_page(const SessionResult& result, const system::Config& config, const ReportSource& source) {
  return report::page_with_data(report_text(result, config, source));
}

}  // namespace bslam::session
