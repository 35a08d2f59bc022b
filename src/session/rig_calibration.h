// Calibration of a rig from recordings of any scene, beginning with a rough calibration.
#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <string>

#include "calibration/joint_refinement.h"
#include "dataset/dataset.h"
#include "place/vocabulary.h"
#include "session/run_record.h"
#include "system/config.h"

namespace bslam::session {

struct RigCalibrationRequest {
  system::Config config;  // calibration.refine must be kTrue; calibration.sigma_*: how rough the start is
  place::VocabularyPtr vocabulary;
  std::stop_token interrupted;
  std::function<void(std::size_t done, std::size_t all)> progress;  // frames of the present run; may be empty
};

// A camera that was moved during a recording. The calibration is that before it; if there are other recordings without
// moves, this one does not count, since it is not known which of its parts they belong to.
struct MoveInRecording {
  std::string recording;
  CameraMoveRecord move;
  bool left_out = false;
};

struct RigCalibration {
  camera::Rig start;  // the given calibration of the cameras in use
  calibration::JointRefinement joint;
  int runs = 0;
  bool converged = false;  // the last run of each recording changed no value by more than its standard deviation
  // Relative standard deviation of the common factor of all distances between cameras, which images do not reveal; 0
  // for a single camera.
  double scale_std = 0;
  camera::Rig whole;  // `joint.rig` together with the cameras of the calibration that were not used
  std::vector<MoveInRecording> moves = {};
  std::vector<std::string> topics = {};  // those of the images of `whole`, if the calibration of the start names them
};

// The configuration of a calibration: sequential, always refined, and with the deviations of a rough start.
system::Config rig_calibration_config();

// The rig with a model without distortion and a horizontal field of view for all cameras, for rigs whose intrinsics are
// not known: pinhole, pinhole-radtan or kannala-brandt. Error: a field of view that the model does not have.
Result<camera::Rig> with_nominal_intrinsics(const camera::Rig& rig, const std::string& model, double fov_deg);

// The recording as if its calibration had the time offsets and readout times of `timed`, a rig of the same cameras. The
// times of its images change with the offsets; its frames keep their images and times.
dataset::Dataset with_times_of(const camera::Rig& timed, dataset::Dataset recording);

// Runs SLAM on each recording, estimates the calibration from the map, and repeats this with the estimate until it does
// not change any more, because the first map contains only the matches that the rough calibration permits. The start
// remains the prior throughout, but the times that one recording shows are the prior of those after it, which may be
// too slow to show them. Estimates from several recordings are combined. The data sets must have the same rig, and
// `recordings` at least one. Errors: those of run_session; a recording from which nothing can be estimated; an
// interruption.
Result<RigCalibration> calibrate_rig(std::span<const dataset::Dataset> recordings,
                                     const RigCalibrationRequest& request);

// The result as a table with standard deviations, followed by a list of values that the recordings do not determine and
// the motion or scene that would be needed.
std::string calibration_text(const RigCalibration& calibration);
// The rig file, with the table as a comment.
std::string calibrated_rig_yaml(const RigCalibration& calibration);

}  // namespace bslam::session
