// The data of report.html, the page that shows a run (web/).
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "session/report_map.h"
#include "session/run_session.h"

namespace bslam::session {

// The part of the data that is available during the run: all of report_json except the command, the settings and the
// comparison with ground truth. `rig` is the rig of the run.
nlohmann::ordered_json run_json(const RunRecord& record, const map::BundledMap& map, const camera::Rig& rig,
                                std::span<const system::SubmapTrajectory> paths, TimeNs first_time_ns,
                                const ReportLimits& limits = {}, const std::optional<geometry::UpAxis>& up = {});

// All settings with their defaults.
nlohmann::ordered_json settings_json(const system::Config& config);

// Everything the page shows: the summary as in summary.json; the rig and the submaps (session/report_map.h); counts per
// frame and camera; durations of stages; residuals over the images; settings with their defaults; errors against ground
// truth (session/report_truth.h). Times are in seconds since the first image of the data set. Large arrays are
// {"f32": base64}. web/src/data.ts describes the structure. The same result gives the same data, except for measured
// times and memory.
nlohmann::ordered_json report_json(const SessionResult& result, const system::Config& config,
                                   const ReportSource& source);

// The same as text.
std::string report_text(const SessionResult& result, const system::Config& config, const ReportSource& source);

// The page with these data. It needs no other file and no network.
std::string report_page(const SessionResult& result, const system::Config& config, const ReportSource& source);

}  // namespace bslam::session
