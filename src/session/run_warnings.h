// Warnings about a run, for the terminal, summary.json and the report.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"
#include "dataset/dataset.h"
#include "session/run_record.h"

namespace bslam::session {

// Before the run: warnings about the recording, and the first ones about the calibration (calibration/rig_warnings.h).
std::vector<std::string> warnings_before_run(const dataset::Dataset& dataset);

// Says which pair of cameras shows that the images do not belong to the calibration; empty if none does.
std::string foreign_images_text(const RunRecord& record);
// Says why the map of a run cannot be relied on: the images do not belong to the calibration, or contradict it and it
// was not refined; empty otherwise.
std::string unreliable_map_text(const RunRecord& record);

// After the run: cameras that were out or inconsistent with all other cameras, images that could not be used, dropped
// frames, losses and submaps, a calibration that the images contradict, and cameras of `rig` (those in use, as
// calibrated) that do not see the same things although their views overlap. `check_command` tests the calibration
// against the images; it is shown for the user to copy.
std::vector<std::string> warnings_after_run(const RunRecord& record, const camera::Rig& rig,
                                            const std::string& check_command);

}  // namespace bslam::session
