#include "calibration/move_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/deviation.h"

namespace bslam::calibration {
namespace {

constexpr double kMillimetresPerMetre = 1000.0;
constexpr std::size_t kMaxMoves = 5;  // of a recording; if others remain, moves are not the reason
constexpr int kMaxDropped = 3;        // moves that are tried without success
constexpr int kMaxCorrections = 3;    // of the times of moves
// A move is accepted if the camera turned or was displaced by so many standard deviations and more than these bounds.
// On recordings without moves, the estimates were below 0.035 degrees and 4.5 mm.
constexpr double kMinMoveSigmas = 6, kMinTurn_deg = 0.04, kMinShift_mm = 5;
// A move is tried if, with poses and points constant, it decreases twice the cost by at least kMinMoveChi2. Its angle
// and displacement are then too small, because poses and points were adjusted as if there was no move. They are
// multiplied by kHidden before they are compared with the bounds above.
constexpr double kMinMoveChi2 = 50, kHidden = 6;
// A jump of the time stamps of a camera, of which a part is hidden as well
constexpr double kMinJump_s = 0.5e-3;

// Move m of an estimate. `covariance`: of RigInformation::change.
MoveEstimate move_of(const RigEstimate& estimate, const Eigen::MatrixXd& covariance, std::size_t m) {
  const std::vector<camera::CameraMove>& moves = estimate.cameras.moves();
  const std::vector<geometry::SE3>& T_cam_rig = estimate.adjusted.values.T_cam_rig;
  const std::size_t before = estimate.cameras.before(m), after = T_cam_rig.size() - moves.size() + m;
  const auto at = [](std::size_t camera) { return 6 * (static_cast<Eigen::Index>(camera) - 1); };
  geometry::Matrix6d of_change = covariance.block<6, 6>(at(after), at(after));
  if (before > 0) {
    of_change += covariance.block<6, 6>(at(before), at(before));
    of_change -= covariance.block<6, 6>(at(before), at(after)) + covariance.block<6, 6>(at(after), at(before));
  }
  const geometry::Vector6d change = solver::extrinsic_change(T_cam_rig[after], T_cam_rig[before]);
  const Eigen::Matrix3d turn = of_change.topLeftCorner<3, 3>(), shift = of_change.bottomRightCorner<3, 3>();
  return {.camera = moves[m].camera,
          .time_ns = moves[m].time_ns,
          .change_deg = geometry::degrees(change.head<3>().norm()),
          .std_deg = geometry::degrees(largest_deviation(turn)),
          .change_mm = kMillimetresPerMetre * change.tail<3>().norm(),
          .std_mm = kMillimetresPerMetre * largest_deviation(shift),
          .rotation_sigmas = mahalanobis_distance(change.head<3>(), turn),
          .translation_sigmas = mahalanobis_distance(change.tail<3>(), shift)};
}

bool significant(const MoveEstimate& move) {
  return (move.rotation_sigmas > kMinMoveSigmas && move.change_deg > kMinTurn_deg) ||
         (move.translation_sigmas > kMinMoveSigmas && move.change_mm > kMinShift_mm);
}

// The time of the first keyframe of this run; nullopt if some of a loaded map are later, since their times are then not
// those of this recording.
std::optional<TimeNs> begin_of_run(const EstimateInput& input) {
  TimeNs loaded = std::numeric_limits<TimeNs>::min(), begin = std::numeric_limits<TimeNs>::max();
  for (const KeyframeId k : input.map.keyframe_ids()) {
    const TimeNs time_ns = input.map.keyframe(k).frame->time_ns;
    if (k < input.first) loaded = std::max(loaded, time_ns);
    if (k >= input.first) begin = std::min(begin, time_ns);
  }
  return loaded < begin ? std::optional(begin) : std::nullopt;
}

// The most likely further move of a camera that is not among the `dropped` ones; nullopt if there is hardly any
// evidence for one.
std::optional<PossibleMove> likely_move(const EstimateInput& input, const RigEstimate& estimate,
                                        std::span<const std::size_t> dropped) {
  const auto begin = begin_of_run(input);
  if (!estimate.adjusted.done || !begin) return std::nullopt;
  std::optional<PossibleMove> best;
  for (const PossibleMove& move :
       estimate.cameras.likely_moves(input.map, estimate.problem, estimate.adjusted.values, *begin)) {
    const double turn_deg = geometry::degrees(move.change.head<3>().norm()),
                 shift_mm = kMillimetresPerMetre * move.change.tail<3>().norm();
    const bool small = kHidden * turn_deg < kMinTurn_deg && kHidden * shift_mm < kMinShift_mm;
    if (move.chi2 < kMinMoveChi2 || small || std::ranges::count(dropped, move.camera) > 0) continue;
    if (!best || move.chi2 > best->chi2) best = move;
  }
  return best;
}

// The jump of the time stamps of a camera that explains what the images show better than the move does, although it has
// one unknown instead of six. If the rig moves steadily, both explain it equally well.
std::optional<TimeJump> jump_instead(const EstimateInput& input, const RigEstimate& estimate,
                                     const PossibleMove& move) {
  const auto begin = begin_of_run(input);
  if (!begin) return std::nullopt;
  auto jump = likely_jump(input.map, estimate.problem, estimate.adjusted.values, move.camera, *begin);
  if (!jump || jump->chi2 <= move.chi2 || std::abs(jump->shift_s) < kMinJump_s) return std::nullopt;
  jump->camera = estimate.cameras.camera_of_rig(move.camera);
  return jump;
}

// Returns true if these are moves of the same cameras at the same times.
bool same_moves(const std::vector<camera::CameraMove>& a, const std::vector<camera::CameraMove>& b) {
  const auto place = [](const camera::CameraMove& move) { return std::pair(move.camera, move.time_ns); };
  return std::ranges::equal(a, b, {}, place, place);
}

// Estimates with moves. If moves are not the reason for what the images show, such as jitter of the time stamps, every
// further one is different, and the search ends after a number of estimates.
class MoveSearch {
 public:
  explicit MoveSearch(const EstimateInput& input) : input_(input) {}

  bool exhausted() const { return estimates_ >= kMaxEstimates; }

  // Estimates the calibration with those of these moves that are significant, at the times that fit best. Without one
  // of them, the others are different.
  RigEstimate estimate_significant_moves(const RigAdjustmentOptions& prior, MovedCameras cameras) {
    RigEstimate out = estimate_at_best_times(prior, std::move(cameras));
    while (out.adjusted.done && !exhausted()) {
      const std::vector<MoveEstimate> moves = moves_of(out);
      std::vector<camera::CameraMove> kept;
      for (std::size_t m = 0; m < moves.size(); ++m) {
        if (significant(moves[m])) kept.push_back(out.cameras.moves()[m]);
      }
      if (kept.size() == out.cameras.moves().size()) break;
      MovedCameras fewer(input_.map.rig().size(), std::move(kept));
      const RigAdjustmentOptions prior_of_fewer = prior_with_timing(input_, fewer);
      out = estimate_at_best_times(prior_of_fewer, std::move(fewer));
    }
    return out;
  }

  // Estimates the calibration with a further move.
  RigEstimate estimate_with(const RigEstimate& before, const PossibleMove& move) {
    const KeyframeId first = before.problem.selected.keyframes[move.pose];
    MovedCameras more =
        before.cameras.with_move(before.adjusted.values, move, input_.map.keyframe(first).frame->time_ns);
    // The effect of the move may have looked like wrong times, which are tested again.
    const RigAdjustmentOptions prior = prior_with_timing(input_, more);
    return estimate_significant_moves(prior, std::move(more));
  }

 private:
  static constexpr int kMaxEstimates = 16;  // three moves of one recording need about ten

  RigEstimate estimate(const RigAdjustmentOptions& prior, MovedCameras cameras) {
    ++estimates_;
    return estimate_rig(input_, prior, std::move(cameras));
  }

  RigEstimate estimate_at_best_times(const RigAdjustmentOptions& prior, MovedCameras cameras) {
    RigEstimate out = estimate(prior, std::move(cameras));
    for (int i = 0; i < kMaxCorrections && out.adjusted.done && !exhausted(); ++i) {
      auto moves = out.cameras.at_best_times(input_.map, out.problem, out.adjusted.values);
      if (same_moves(moves, out.cameras.moves())) break;
      out = estimate(prior, {input_.map.rig().size(), std::move(moves)});
    }
    return out;
  }

  const EstimateInput& input_;
  int estimates_ = 0;
};

}  // namespace

std::vector<MoveEstimate> moves_of(const RigEstimate& estimate) {
  std::vector<MoveEstimate> out;
  const Eigen::LLT<Eigen::MatrixXd> factor(estimate.adjusted.information.information);
  if (!estimate.adjusted.done || factor.info() != Eigen::Success) return out;
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(factor.rows(), factor.cols()));
  for (std::size_t m = 0; m < estimate.cameras.moves().size(); ++m) out.push_back(move_of(estimate, covariance, m));
  return out;
}

RigEstimate estimate_rig_and_moves(const EstimateInput& input, const RigAdjustmentOptions& prior,
                                   MovedCameras cameras) {
  MoveSearch search(input);
  RigEstimate known = cameras.moves().empty() ? estimate_rig(input, prior, std::move(cameras))
                                              : search.estimate_significant_moves(prior, std::move(cameras));
  if (!known.settled) return known;
  // The first moves that are found may be at wrong times and be replaced by others.
  std::optional<RigEstimate> latest;
  std::vector<std::size_t> dropped;  // cameras of the latest problem
  for (int failed = 0; failed < kMaxDropped;) {
    const RigEstimate& before = latest ? *latest : known;
    const auto move = likely_move(input, before, dropped);
    if (!move) break;
    if (auto jump = jump_instead(input, before, *move)) {
      known.jump = std::move(jump);
      known.unsteady.reset();  // the jump explains it
      return known;
    }
    if (known.unsteady) return known;
    if (before.cameras.moves().size() >= kMaxMoves || search.exhausted()) return known;  // something else than moves
    RigEstimate next = search.estimate_with(before, *move);
    if (next.adjusted.done && !same_moves(next.cameras.moves(), before.cameras.moves())) {
      latest = std::move(next);
      dropped.clear();
    } else {
      dropped.push_back(move->camera);
      ++failed;
    }
  }
  // A search that was stopped may have found moves at wrong times.
  return latest && !input.stop.stop_requested() ? *std::move(latest) : std::move(known);
}

}  // namespace bslam::calibration
