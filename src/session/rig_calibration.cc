#include "session/rig_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/assert.h"
#include "calibration/calibration_prior.h"
#include "camera/model_table.h"
#include "session/run_session.h"

namespace bslam::session {
namespace {

constexpr int kMaxRuns = 4;  // per recording

Error nothing_estimated(const dataset::Dataset& recording, const SessionResult& run) {
  const std::string found = run.live.empty()                   ? "no frame that could be tracked"
                            : run.record.map.scale != "metric" ? "a map of scale " + run.record.map.scale
                                                               : "too few landmarks";
  return {recording.name, "", found,
          "a map of metric scale with some hundred landmarks: two cameras that see near points"};
}

// Whether each value of two estimates from the same recording agrees within one standard deviation.
bool agree(const calibration::RigInformation& a, const calibration::RigInformation& b) {
  if (a.change.size() != b.change.size()) return false;
  const Eigen::VectorXd difference = a.change - b.change;
  const Eigen::MatrixXd covariance =
      b.information.llt().solve(Eigen::MatrixXd::Identity(b.information.rows(), b.information.cols()));
  return (difference.array().square() <= covariance.diagonal().array()).all();
}

// The common factor of the distances is the weighted mean of the factors of all cameras, whose positions are measured
// independently of each other. Their larger deviation along the optical axes is left out.
double scale_deviation(const camera::Rig& rig, const calibration::CalibrationOptions& options) {
  double squares = 0;
  for (std::size_t c = 1; c < rig.size(); ++c) squares += rig.rig_from_cam(c).translation().squaredNorm();
  if (squares == 0) return 0;
  return std::max(calibration::translation_deviation(rig, options) / std::sqrt(squares),
                  0.01 * options.sigma_scale_percent);
}

// The estimate from one recording, and the runs it took.
struct Passes {
  std::string recording;
  calibration::RigRefinement refinement;
  std::vector<CameraMoveRecord> moves;
  int runs = 0;
  bool converged = false;
};

Result<Passes> run_passes(const dataset::Dataset& recording, const RigCalibrationRequest& request, camera::Rig rig) {
  SessionOptions options;
  options.config = request.config;
  options.interrupted = request.interrupted;
  options.vocabulary = request.vocabulary;
  options.progress = request.progress;
  Passes out;
  out.recording = recording.name;
  while (out.runs < kMaxRuns && !out.converged) {
    options.initial_rig = rig;
    auto run = run_session(recording, options);
    if (!run) return run.error();
    if (request.interrupted.stop_requested()) {
      return Error{recording.name, "", "interrupted", "a complete calibration",
                   recording.name + ": interrupted before the calibration was complete; nothing is written"};
    }
    if (!run->calibration.done) return nothing_estimated(recording, *run);
    out.converged = out.runs > 0 && agree(out.refinement.information, run->calibration.information);
    ++out.runs;
    out.refinement = std::move(run->calibration);
    out.moves = std::move(run->record.calibration.moves);
    rig = out.refinement.rig->with_moves({});  // each run finds them at their time
  }
  return out;
}

// Leaves out recordings in which a camera was moved, but one if no other remains. Returns the moves.
std::vector<MoveInRecording> leave_out_moves(std::vector<Passes>& all) {
  const auto still = [](const Passes& passes) { return passes.moves.empty(); };
  const bool only_moved = std::ranges::none_of(all, still);
  std::vector<MoveInRecording> out;
  for (const Passes& passes : all) {
    const bool left_out = !only_moved || &passes != &all.front();
    for (const CameraMoveRecord& move : passes.moves) out.push_back({passes.recording, move, left_out});
  }
  if (only_moved) all.erase(all.begin() + 1, all.end());
  std::erase_if(all, [&](const Passes& passes) { return !only_moved && !still(passes); });
  return out;
}

}  // namespace

system::Config rig_calibration_config() {
  system::Config config;
  config.mode = execution::Mode::kSequential;
  config.calibration.refine = calibration::Refine::kTrue;
  config.calibration.sigma_rotation_deg = config.mapping.scale.sigma_rotation_deg = 3.0;
  config.calibration.sigma_translation_mm = 20.0;
  config.calibration.sigma_focal_percent = 10.0;
  config.calibration.sigma_centre_percent = 2.0;
  return config;
}

Result<camera::Rig> with_nominal_intrinsics(const camera::Rig& rig, const std::string& model, double fov_deg) {
  const bool fisheye = model == camera::KannalaBrandt::kName;
  const double largest = fisheye ? 300 : 160;
  const camera::ModelRow* row = camera::find_model(model);
  if (row == nullptr || (!fisheye && model != camera::Pinhole::kName && model != camera::PinholeRadTan::kName))
    return Error{"command line", "--model", model, "pinhole, pinhole-radtan or kannala-brandt"};
  if (!(fov_deg > 5 && fov_deg < largest))
    return Error{"command line", "--fov", fmt::format("{}", fov_deg),
                 fmt::format("5 to {} degrees for {}", largest, model)};
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    camera::Camera camera = rig.camera(c);
    const double half = geometry::radians(fov_deg) / 2, half_width = 0.5 * camera.width;
    const double focal = half_width / (fisheye ? half : std::tan(half));
    camera.model = row->make({focal, focal, half_width - 0.5, 0.5 * camera.height - 0.5},
                             std::vector<double>(row->counts.front(), 0.0));
    cameras.push_back({std::move(camera), rig.body_from_cam(c)});
  }
  return camera::Rig(std::move(cameras));
}

dataset::Dataset with_times_of(const camera::Rig& timed, dataset::Dataset recording) {
  std::vector<camera::RigCamera> cameras;
  bool differ = false;
  for (std::size_t c = 0; c < recording.rig.size(); ++c) {
    cameras.push_back({recording.rig.camera(c), recording.rig.body_from_cam(c)});
    camera::Camera& camera = cameras.back().camera;
    const TimeNs later_ns = timed.camera(c).time_offset_ns - camera.time_offset_ns;
    differ |= later_ns != 0 || timed.camera(c).readout_s != camera.readout_s;
    camera.time_offset_ns += later_ns;
    camera.readout_s = timed.camera(c).readout_s;
    for (dataset::FrameEntry& frame : recording.frames) {
      if (frame.images[c]) frame.images[c]->time_ns += later_ns;
    }
  }
  if (differ) recording.rig = camera::Rig(std::move(cameras), recording.rig.cam_from_rig(0));
  return recording;
}

Result<RigCalibration> calibrate_rig(std::span<const dataset::Dataset> recordings,
                                     const RigCalibrationRequest& request) {
  BSLAM_ASSERT(!recordings.empty(), "there must be a recording");
  const camera::Rig& start = recordings.front().rig;
  std::vector<Passes> all;
  camera::Rig rig = start;
  int runs = 0;
  bool converged = true;
  for (const dataset::Dataset& recording : recordings) {
    auto passes = run_passes(with_times_of(rig, recording), request, rig);
    if (!passes) return passes.error();
    runs += passes->runs;
    converged = converged && passes->converged;
    rig = passes->refinement.rig->after_moves();
    all.push_back(*std::move(passes));
  }
  std::vector<MoveInRecording> moves = leave_out_moves(all);
  std::vector<calibration::RigRefinement> refinements;
  for (Passes& passes : all) refinements.push_back(std::move(passes.refinement));
  auto joint = calibration::combine(start, refinements);
  if (!joint) return Error{recordings.front().name, "", "an estimate without deviations", "more landmarks"};
  const dataset::Dataset& first = recordings.front();
  camera::Rig whole =
      first.whole_rig ? first.whole_rig->with_calibration_of(joint->rig, first.cameras_used) : joint->rig;
  const double scale_std = scale_deviation(start, request.config.calibration);
  return RigCalibration{
      start, *std::move(joint), runs, converged, scale_std, std::move(whole), std::move(moves), first.rig_topics};
}

}  // namespace bslam::session
