#include "session/run_warnings.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/rig_warnings.h"
#include "session/estimate_warnings.h"
#include "session/warning_list.h"

namespace bslam::session {
namespace {

// Such as "1.27 - 3.40 s"; for a single frame "at 1.27 s".
std::string interval_text(double from_s, double to_s) {
  return from_s == to_s ? fmt::format("at {:.2f} s", from_s) : fmt::format("{:.2f} - {:.2f} s", from_s, to_s);
}

void warn_of_outages(const CameraRecord& camera, Warnings& warnings) {
  constexpr std::size_t kShown = 3;
  std::string shown;
  std::size_t outages = 0;
  for (const CameraInterval& s : camera.states) {
    if (s.status.state == tracking::CameraState::kOk || ++outages > kShown) continue;
    shown += fmt::format("{}{} {} ({})", shown.empty() ? "" : ", ", tracking::describe(s.status.state),
                         interval_text(s.from_s, s.to_s), tracking::describe(s.status.reason));
  }
  if (outages == 0) return;
  if (outages > kShown) shown += fmt::format(" and {} more intervals", outages - kShown);
  warn(warnings, "{}: {}", camera.name, shown);
}

// Lists the intervals without a pose.
void warn_of_losses(const RunRecord& record, const std::string& check_command, Warnings& warnings) {
  constexpr std::size_t kShown = 5;
  const std::vector<LostInterval> intervals = lost_intervals(record);
  if (intervals.empty()) return;
  std::string shown;
  for (std::size_t i = 0; i < std::min(kShown, intervals.size()); ++i) {
    shown += fmt::format("{}{} ({})", i == 0 ? "" : ", ", interval_text(intervals[i].from_s, intervals[i].to_s),
                         intervals[i].reason);
  }
  if (intervals.size() > kShown)
    shown += fmt::format(" and {} more intervals, see summary.json", intervals.size() - kShown);
  const std::int64_t lost = count(record, FrameOutcome::kLost);
  warn(warnings, "{} of {} frames have no pose: {}", lost, record.frames.size(), shown);
  if (!mostly_lost(record) || record.calibration.foreign_images()) return;
  if (record.calibration.verdict() == calibration::Verdict::kConsistent) {
    warn(warnings,
         "most frames have no pose, but where there are poses the images agree with the calibration: too little light "
         "or texture, fast motion and moving objects are likelier reasons");
  } else {
    warn(warnings, "most frames have no pose, maybe because of a wrong calibration: test it ({})", check_command);
  }
}

// Warns if the poses have no common world frame, or not that of the loaded map.
void warn_of_submaps(const RunRecord& record, Warnings& warnings) {
  if (record.submaps.size() > 1) {
    warn(warnings,
         "{} submaps remain, each with its own world frame, because no loop closure joined them; number of poses in "
         "trajectory.tum: {}, in trajectory_part2.tum: {}{}",
         record.submaps.size(), record.submaps[0].frames, record.submaps[1].frames,
         record.submaps.size() > 2 ? " and so on" : "");
  }
  if (!record.map.loaded) return;
  std::int64_t outside = 0;
  for (const SubmapRecord& submap : record.submaps) outside += submap.loaded ? 0 : submap.frames;
  const std::int64_t inside = frames_in_loaded_map(record);
  if (outside == 0 && inside > 0) return;
  if (outside == 0) {
    warn(warnings, "no frames have a pose, since no place of the loaded map was recognised");
    return;
  }
  const std::string found = inside == 0 ? "no" : std::to_string(inside);
  warn(warnings,
       "{} frames have a pose in the frame of the loaded map; {} frames are in a new submap, since no "
       "place of the loaded map was recognised there",
       found, outside);
}

// Warns about a camera that is still inconsistent with the others at the end of the run, or was so for most of it: its
// time stamps or calibration are probably wrong.
void warn_of_disagreement(const RunRecord& record, std::size_t camera, const std::string& check_command,
                          Warnings& warnings) {
  constexpr tracking::CameraStatus kDisagrees{tracking::CameraState::kDegraded, tracking::CameraReason::kInconsistent};
  const std::vector<CameraInterval>& states = record.cameras[camera].states;
  if (states.empty() || states.back().status != kDisagrees) {
    if (std::ranges::count(record.calibration.disagreeing, camera) > 0)
      warn(warnings,
           "{}: inconsistent with the other cameras for most of the run: its time stamps or its calibration are wrong; "
           "test them ({}), or estimate the calibration with bslam rig calibrate",
           record.cameras[camera].name, check_command);
    return;
  }
  std::int64_t keypoints = 0, inliers = 0;
  for (const RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    keypoints += frame.record->final_result().cameras[camera].keypoints;
    inliers += frame.record->final_result().cameras[camera].inliers;
  }
  // The verdict does not apply to a camera whose matches were not used.
  warn(warnings,
       "{}: only {} of {} keypoints are where the map predicts them: its time stamps or its calibration are wrong, or "
       "it is exchanged with another camera; test them ({}), or estimate the calibration with bslam rig calibrate{}",
       record.cameras[camera].name, inliers, keypoints, check_command,
       record.calibration.verdict() == calibration::Verdict::kConsistent
           ? "; if these are right, something covers it or moves in front of it, or it was moved"
           : "");
}

std::string late_text(const RunRecord& record) {
  const calibration::LateCamera& late = *record.calibration.late;
  return calibration::describe_late_camera(late, record.cameras[late.camera].name, record.cameras[late.reference].name);
}

// The contradicted pair with the most matches; if there is none, one that is not contradicted, or the end.
std::vector<calibration::CameraPair>::const_iterator most_contradicted(
    const std::vector<calibration::CameraPair>& pairs) {
  const auto weight = [](const calibration::CameraPair& p) { return p.contradicted ? p.evidence->matches : -1; };
  return std::ranges::max_element(pairs, {}, weight);
}

// Warns of pairs of cameras that should see the same things but do not.
void warn_of_pairs(const RunRecord& record, const std::string& check_command, Warnings& warnings) {
  if (const std::string foreign = foreign_images_text(record); !foreign.empty()) {
    const calibration::CameraPair& pair = *most_contradicted(record.calibration.pairs);
    const bool mirrored = pair.mirrored() || pair.evidence->mirrored;
    return warn(warnings, "{}. {} ({})", foreign,
                mirrored ? "Turn off the mirroring of the cameras or of their driver"
                         : "Check which images are of which camera, and the direction of the transforms",
                check_command);
  }
  if (const int fitting = record.calibration.pairs_as_given; never_started(record) && fitting > 0) {
    warn(warnings,
         "no map was started although there were images, and those of {} pair{} of cameras agree with the calibration: "
         "too little texture or motion is a likelier reason than a wrong calibration ({})",
         fitting, fitting == 1 ? "" : "s", check_command);
  } else if (never_started(record)) {
    warn(warnings, "no map was started although there were images, maybe because of a wrong calibration: test it ({})",
         check_command);
  }
  for (const calibration::CameraPair& pair : record.calibration.pairs) {
    warn(warnings, "{} ({})",
         calibration::describe_hardly_matched(pair, record.cameras[pair.first].name, record.cameras[pair.second].name),
         check_command);
  }
}

// Warns if two motions were similarly well supported for some time, so that the poses may be relative to moving
// objects, unless a late camera or a wrong calibration explains it.
void warn_of_moving_objects(const RunRecord& record, Warnings& warnings) {
  const std::vector<ContestedInterval> intervals = contested_intervals(record);
  if (intervals.empty() || record.calibration.late || record.calibration.foreign_images()) return;
  const ContestedInterval& first = intervals.front();
  warn(
      warnings,
      "two motions explain similarly many landmarks {}{}: if people or vehicles fill the view there, the poses and the "
      "map from then on may follow them; start where the view is free, or mask what moves (--masks)",
      interval_text(first.from_s, first.to_s),
      intervals.size() > 1 ? fmt::format(" and in {} more intervals", intervals.size() - 1) : "");
}

// Warns of frames and work that were omitted because processing was too slow.
void warn_of_load(const RunRecord& record, Warnings& warnings) {
  std::int64_t reduced = 0;
  for (const ReducedInterval& interval : reduced_intervals(record)) reduced += interval.frames;
  if (reduced > 0) {
    warn(warnings,
         "fewer keypoints, landmarks and keyframes in {} of {} frames: processing all would have been slower than real "
         "time",
         reduced, record.frames.size());
  }
  const auto dropped = count(record, FrameOutcome::kDropped);
  if (dropped > 0) warn(warnings, "{} frames dropped: processing is slower than real time", dropped);
}

std::string what_is_foreign(const RunRecord& record, const calibration::CameraPair& pair) {
  const std::string names = fmt::format("{} and {}", record.cameras[pair.first].name, record.cameras[pair.second].name);
  if (pair.mirrored() && pair.keyframes > 0)
    return fmt::format("the images are mirrored left to right, so poses, scale and map are wrong: of cameras {},",
                       names);
  if (pair.keyframes > 0) {
    return fmt::format(
        "the images do not belong to the calibration, so poses, scale and map are wrong: cameras {} share {:.1f} % of "
        "the features in their common view;",
        names, 100 * pair.matched_share());
  }
  if (never_started(record))
    return fmt::format("the images do not belong to the calibration, so no map was started: of cameras {}", names);
  return fmt::format("the images do not belong to the calibration, so poses, scale and map are wrong: of cameras {}",
                     names);
}

}  // namespace

std::string foreign_images_text(const RunRecord& record) {
  const std::vector<calibration::CameraPair>& pairs = record.calibration.pairs;
  const auto best = most_contradicted(pairs);
  if (best == pairs.end() || !best->contradicted) return {};
  const auto others = std::ranges::count(pairs, true, &calibration::CameraPair::contradicted) - 1;
  return fmt::format("{} {}{}", what_is_foreign(record, *best), calibration::describe_pair(*best->evidence),
                     others > 0 ? fmt::format(" (and {} more pairs)", others) : "");
}

std::string unreliable_map_text(const RunRecord& record) {
  if (std::string foreign = foreign_images_text(record); !foreign.empty()) return foreign;
  const CalibrationRecord& calibration = record.calibration;
  if (calibration.late) return late_text(record);
  const bool contradicted = calibration.estimate.verdict == calibration::Verdict::kInconsistent;
  return contradicted && !calibration.refined && record.complete ? contradiction_text(record) : "";
}

std::vector<std::string> warnings_before_run(const dataset::Dataset& dataset) {
  constexpr std::size_t kShown = 2;
  Warnings warnings = dataset.warnings;
  const Warnings about_rig = calibration::rig_warnings(dataset.rig);
  for (std::size_t i = 0; i < std::min(kShown, about_rig.size()); ++i) warnings.push_back(about_rig[i]);
  if (about_rig.size() > kShown)
    warn(warnings, "{} more warnings about the calibration: bslam rig info", about_rig.size() - kShown);
  return warnings;
}

std::vector<std::string> warnings_after_run(const RunRecord& record, const camera::Rig& rig,
                                            const std::string& check_command) {
  Warnings warnings;
  if (record.calibration.late)
    warnings.push_back(late_text(record) +
                       ", and run again: poses and scale are less accurate until then, and no "
                       "rig_refined.yaml is written");
  warn_of_pairs(record, check_command, warnings);
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const CameraRecord& camera = record.cameras[c];
    if (camera.skipped > 0) {
      warn(warnings, "{}: {} of its images could not be read, the first: {}", camera.name, camera.skipped,
           camera.first_skipped);
    }
    if (camera.stamp_error_s > 0) {
      warn(warnings,
           "{}: its time stamps have errors of about {:.1f} ms that differ from image to image; the times at which its "
           "images were captured were estimated from what they show",
           camera.name, 1e3 * camera.stamp_error_s);
    }
    warn_of_outages(camera, warnings);
    warn_of_disagreement(record, c, check_command, warnings);
  }
  const Warnings of_estimate = estimate_warnings(record, rig);
  warnings.insert(warnings.end(), of_estimate.begin(), of_estimate.end());
  warn_of_losses(record, check_command, warnings);
  warn_of_submaps(record, warnings);
  warn_of_moving_objects(record, warnings);
  warn_of_load(record, warnings);
  return warnings;
}

}  // namespace bslam::session
