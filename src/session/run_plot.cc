#include "session/run_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "report/figure.h"
#include "session/residual_plot.h"

namespace bslam::session {

namespace {

using namespace report;  // figures

constexpr std::size_t kBins = 450;  // intervals of time, about one for every two pixels

using Points = std::vector<std::array<double, 2>>;

Series time_series(std::string label, Points points, std::string_view colour, double width_px) {
  Series series;
  series.label = std::move(label);
  series.points = std::move(points);
  series.colour = colour;
  series.width_px = width_px;
  return series;
}

// Returns one of the counts of a camera over all frames, with gaps at frames without an image of the camera.
Points camera_points(const RunRecord& record, std::size_t camera, int tracking::CameraCounts::*count) {
  Points points;
  for (const RunFrame& frame : record.frames) {
    const bool seen = frame.record && camera < frame.record->images.size() &&
                      frame.record->images[camera] == image::ImageState::kPresent;
    points.push_back(
        {frame.time_s, seen ? static_cast<double>(frame.record->final_result().cameras[camera].*count) : kGap});
  }
  return reduced(points, kBins, Reduction::kMedian);
}

// Returns a panel with the time range of the run and the intervals in which tracking was lost.
Panel time_panel(const RunRecord& record, std::string title, std::string y_label) {
  Panel panel{.title = std::move(title), .x_label = "time [s]", .y_label = std::move(y_label)};
  panel.floor = AxisFloor::kZero;
  const double half_interval = record.frames.size() > 1
                                   ? 0.5 * (record.frames.back().time_s - record.frames.front().time_s) /
                                         static_cast<double>(record.frames.size() - 1)
                                   : 0.0;
  for (const LostInterval& interval : lost_intervals(record)) {
    panel.bands.push_back({.from = interval.from_s - half_interval, .to = interval.to_s + half_interval});
  }
  if (!panel.bands.empty()) panel.extra_legend.push_back({"lost", std::string(kVermilion)});
  if (!record.frames.empty()) {  // invisible points that set the range of x
    panel.series.push_back(time_series("", {{record.frames.front().time_s, 0.0}}, "none", 0.0));
    panel.series.push_back(time_series("", {{record.frames.back().time_s, 0.0}}, "none", 0.0));
  }
  return panel;
}

std::string camera_name(const RunRecord& record, std::size_t camera) {
  return camera < record.cameras.size() ? record.cameras[camera].name : fmt::format("camera {}", camera);
}

std::size_t camera_count(const RunRecord& record) {
  std::size_t count = record.cameras.size();
  for (const RunFrame& frame : record.frames) count = std::max(count, frame.record ? frame.record->images.size() : 0);
  return count;
}

Panel keypoint_panel(const RunRecord& record) {
  Panel panel = time_panel(record, "Keypoints by camera", "keypoints");
  for (std::size_t i = 0; i < camera_count(record); ++i) {
    panel.series.push_back(time_series(
        camera_name(record, i), camera_points(record, i, &tracking::CameraCounts::keypoints), series_colour(i), 1.5));
  }
  return panel;
}

Panel inlier_panel(const RunRecord& record) {
  Panel panel = time_panel(record, "Landmarks matched (thin) and inliers (bold) by camera", "landmarks");
  for (std::size_t i = 0; i < camera_count(record); ++i) {
    panel.series.push_back(
        time_series("", camera_points(record, i, &tracking::CameraCounts::matched), series_colour(i), 0.7));
    panel.series.push_back(time_series(
        camera_name(record, i), camera_points(record, i, &tracking::CameraCounts::inliers), series_colour(i), 2.0));
  }
  Series keyframes = time_series("keyframe", {}, kBlack, 6.0);
  keyframes.style = SeriesStyle::kPoints;
  for (const RunFrame& frame : record.frames) {
    if (frame.record && frame.record->keyframe) keyframes.points.push_back({frame.time_s, 0.0});
  }
  if (!keyframes.points.empty()) panel.series.push_back(std::move(keyframes));
  for (const PlaceEvent& loop : record.loops) panel.marks.push_back({loop.at_s, std::string(kPurple)});
  for (const PlaceEvent& event : record.relocalisations) panel.marks.push_back({event.at_s, std::string(kOrange)});
  if (!record.loops.empty()) panel.extra_legend.push_back({"loop closed", std::string(kPurple)});
  if (!record.relocalisations.empty()) panel.extra_legend.push_back({"relocalised", std::string(kOrange)});
  return panel;
}

// Colours of the reasons of faults, distinct from those of the cameras (Paul Tol's muted palette).
std::string_view reason_colour(std::size_t k) {
  constexpr std::array<std::string_view, 6> kColours = {"#882255", "#44AA99", "#999933",
                                                        "#332288", "#AA4499", "#DDCC77"};
  return kColours[k % kColours.size()];
}

// Returns a panel with a bar for every interval in which a camera was degraded or out, in the row of the camera and the
// colour of the reason. Bars that are too close to be distinguished are merged. Returns nullopt if there were no
// faults.
std::optional<Panel> camera_fault_panel(const RunRecord& record) {
  if (record.frames.empty()) return std::nullopt;
  const double begin_s = record.frames.front().time_s, end_s = record.frames.back().time_s,
               apart_s = (end_s - begin_s) / kBins;
  Panel panel = time_panel(record, "Camera faults", "");
  panel.floor = AxisFloor::kFromData;
  panel.series.push_back(
      time_series("", {{begin_s, -0.5}, {end_s, static_cast<double>(record.cameras.size()) - 0.5}}, "none", 0.0));
  for (std::size_t i = 0; i < record.cameras.size(); ++i) {
    panel.y_ticks.push_back({static_cast<double>(i), record.cameras[i].name});
  }
  const std::size_t without = panel.series.size();
  for (std::size_t i = 0; i < record.cameras.size(); ++i) {
    const double y = static_cast<double>(i);
    for (const CameraInterval& interval : record.cameras[i].states) {
      if (interval.status.state == tracking::CameraState::kOk) continue;
      const std::string why =
          fmt::format("{}: {}", tracking::describe(interval.status.state), tracking::describe(interval.status.reason));
      auto series = std::ranges::find(panel.series, why, &Series::label);
      if (series == panel.series.end()) {
        const std::size_t k = panel.series.size() - without;
        series = panel.series.insert(series, time_series(why, {}, reason_colour(k), 6.0));
      }
      Points& bars = series->points;
      auto* const last =
          bars.empty() ? nullptr : &bars[bars.size() - 2];  // end of the previous bar; a line break follows it
      if (last != nullptr && (*last)[1] == y && interval.from_s - (*last)[0] < apart_s) {
        (*last)[0] = interval.to_s;
      } else {
        bars.insert(bars.end(), {{interval.from_s, y}, {interval.to_s, y}, {kGap, kGap}});
      }
    }
  }
  if (panel.series.size() == without) return std::nullopt;
  return panel;
}

Points stage_points(const StageSeries& stage) {
  Points points;
  for (const StageSample& sample : stage.samples) points.push_back({sample.time_s, sample.ms});
  return points;
}

Panel frame_time_panel(const RunRecord& record) {
  Panel panel = time_panel(record, "Processing time per frame, by stage", "time [ms]");
  Points total;
  for (const RunFrame& frame : record.frames) {
    total.push_back({frame.time_s, frame.record ? frame.record->frame_ms : kGap});
  }
  if (total.size() > kBins) {
    panel.series.push_back(time_series("frame, maximum", reduced(total, kBins, Reduction::kMaximum), "#BBBBBB", 1.0));
  }
  panel.series.push_back(time_series("frame", reduced(total, kBins, Reduction::kMedian), kBlack, 1.8));
  std::size_t k = 0;
  for (const StageSeries& stage : record.stages) {
    if (stage.thread != StageThread::kCaller) continue;
    panel.series.push_back(
        time_series(stage.name, reduced(stage_points(stage), kBins, Reduction::kMedian), series_colour(k++), 1.3));
  }
  return panel;
}

Panel background_panel(const RunRecord& record, std::span<const StageSeries* const> stages) {
  Panel panel = time_panel(record, "Background stages: time per call", "time [ms]");
  std::size_t k = 0;
  for (const StageSeries* stage : stages) {
    Series series = time_series(stage->name, stage_points(*stage), series_colour(k++), 4.0);
    series.style = SeriesStyle::kPoints;
    panel.series.push_back(std::move(series));
  }
  return panel;
}

std::string subtitle_of(const RunRecord& record) {
  const auto tracked = std::ranges::count(record.frames, FrameOutcome::kTracked, &RunFrame::outcome);
  const std::string submaps = record.submaps.size() > 1 ? fmt::format(" in {} submaps", record.submaps.size()) : "";
  return fmt::format("{}{}; {} of {} frames tracked{}; {} keyframes, {} landmarks", record.mode,
                     record.complete ? "" : ", interrupted", tracked, record.frames.size(), submaps,
                     record.map.keyframes, record.map.landmarks);
}

}  // namespace

std::string run_plot_svg(const RunRecord& record) {
  Figure figure{.title = record.data.empty() ? "bslam run" : fmt::format("bslam run: {}", record.data),
                .subtitle = subtitle_of(record)};
  figure.rows.push_back({.height_px = 230.0, .panels = {keypoint_panel(record)}});
  figure.rows.push_back({.height_px = 270.0, .panels = {inlier_panel(record)}});
  if (auto states = camera_fault_panel(record)) {
    figure.rows.push_back(
        {.height_px = 90.0 + 20.0 * static_cast<double>(record.cameras.size()), .panels = {*std::move(states)}});
  }
  for (PanelRow& row : residual_rows(record)) figure.rows.push_back(std::move(row));
  figure.rows.push_back({.height_px = 270.0, .panels = {frame_time_panel(record)}});
  std::vector<const StageSeries*> background;
  for (const StageSeries& stage : record.stages) {
    if (stage.thread == StageThread::kBackground && !stage.samples.empty()) background.push_back(&stage);
  }
  if (!background.empty())
    figure.rows.push_back({.height_px = 250.0, .panels = {background_panel(record, background)}});
  return figure_svg(figure);
}

}  // namespace bslam::session
