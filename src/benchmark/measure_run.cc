#include "benchmark/measure_run.h"

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"

namespace bslam::benchmark {
namespace {

using evaluation::Trajectory;
using nlohmann::json;

constexpr std::size_t kMaxSummaryBytes = std::size_t{1} << 28;

std::optional<double> number(const json& summary, const char* pointer) {
  const json::json_pointer at(pointer);
  if (!summary.contains(at) || !summary.at(at).is_number()) return std::nullopt;
  return summary.at(at).get<double>();
}

int count(const json& summary, const char* pointer) { return static_cast<int>(number(summary, pointer).value_or(0.0)); }

int length(const json& summary, const char* key) {
  const auto found = summary.find(key);
  return found == summary.end() || !found->is_array() ? 0 : static_cast<int>(found->size());
}

Result<double> position_rmse(const Trajectory& estimate, const Trajectory& truth) {
  const auto result = evaluation::evaluate(estimate, truth, {});
  if (!result) return result.error();
  return result->ate.rmse;
}

// Sets the errors of `m` that this ground truth defines. The path of protocol P is that of the camera itself.
Status compare(const std::filesystem::path& folder, const Sequence& sequence, const geometry::SE3& camera_from_body,
               RunMeasurement& m) {
  const auto final_path = evaluation::read_trajectory(folder / "trajectory.tum");
  if (!final_path) return final_path.error();
  const auto live_path = evaluation::read_trajectory(folder / "trajectory_live.tum");
  if (!live_path) return live_path.error();
  if (sequence.released && sequence.released->frame == TruthFrame::kBody) {
    const auto truth = evaluation::read_trajectory(sequence.released->file, sequence.released->times);
    if (!truth) return truth.error();
    const auto error = position_rmse(*final_path, *truth);
    if (!error) return error.error();
    m.ate_p_m = *error;
  }
  const Truth& best = sequence.corrected ? *sequence.corrected : *sequence.released;
  m.body_is_camera = best.frame == TruthFrame::kBody && camera_from_body.matrix().isIdentity(0);
  const auto truth = evaluation::read_trajectory(best.file, best.times);
  if (!truth) return truth.error();
  const auto compared = [&](const Trajectory& path) {
    return best.frame == TruthFrame::kBody ? evaluation::moved_to_frame(path, camera_from_body) : path;
  };
  const auto error = position_rmse(compared(*final_path), *truth);
  if (!error) return error.error();
  m.ate_t_m = *error;
  if (const auto live = position_rmse(compared(*live_path), *truth)) m.ate_t_live_m = *live;
  return {};
}

}  // namespace

Result<RunMeasurement> measure_run(const std::filesystem::path& folder, const Sequence& sequence,
                                   const geometry::SE3& body_from_camera) {
  const std::filesystem::path file = folder / "summary.json";
  const auto text = read_file(file, kMaxSummaryBytes);
  if (!text) return text.error();
  const json summary = json::parse(*text, nullptr, false);
  if (!summary.is_object()) return Error{file.string(), "", "no JSON object", "the summary of a run"};
  RunMeasurement m;
  m.frames = count(summary, "/frames/input");
  m.frames_with_pose = count(summary, "/frames/tracked");
  m.submaps = length(summary, "parts");
  m.loops = length(summary, "loops");
  m.frame_ms_median = number(summary, "/time/frame_ms/median");
  m.frame_ms_p95 = number(summary, "/time/frame_ms/p95");
  m.peak_mb = number(summary, "/memory/peak_mb");
  const json::json_pointer verdict("/calibration/verdict");
  m.contradicted = summary.contains(verdict) && summary.at(verdict) == "inconsistent";
  if (m.frames_with_pose > 0 && (sequence.released || sequence.corrected)) {
    if (const Status s = compare(folder, sequence, body_from_camera.inverse(), m); !s) {
      m.truth_problem = s.error().message();
    }
  }
  return m;
}

}  // namespace bslam::benchmark
