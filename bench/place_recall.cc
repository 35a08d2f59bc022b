// Precision and recall of place recognition without the rest of the system: a map that was built without loop closing
// is traversed in order of its creation, and for every keyframe an older place is searched.
//   bslam_place_recall MAP.bmap TRUTH.tum [--older S] [--overlap FRACTION] [--set key=value ...]
// TRUTH: T_world_cam0 at the times of the keyframes. Prints a line of a table.
//
// A place to be recognised exists if, according to the true poses, the keyframe observes the place of another keyframe
// that is more than S seconds older and not a neighbour: at least FRACTION of its landmarks project to an image of this
// keyframe, are not occluded, and are observed from a similar distance (within kZoom) and direction (within
// kMaxViewingAngle) as before, beyond which descriptors cannot be compared. A match is correct if the verified pose
// agrees with the true pose.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <numbers>

#include "base/median.h"
#include "cli/config_arguments.h"
#include "evaluation/trajectory_file.h"
#include "looping/place_recogniser.h"
#include "looping/verify_place.h"
#include "map/map_edit.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"

namespace bslam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

constexpr double kZoom = 1.5;
constexpr double kMaxViewingAngle = std::numbers::pi / 6;  // rad
constexpr double kMaxPositionError = 0.1,
                 kMaxRotationError = 0.05;  // tolerances of a correct pose: relative to the median depth; rad

struct Arguments {
  std::string map, truth;
  double older_s = 8, overlap = 0.3;
  bool detail = false;
  cli::ConfigArguments config;
};

// The landmarks observed by a keyframe, in the frame of its camera 0. They are correct up to the error of the local
// map.
struct View {
  KeyframeId keyframe;
  TimeNs time_ns = 0;
  SE3 T_world_rig;                               // true pose
  std::vector<Vector3d> points;                  // positions of its landmarks
  std::vector<std::vector<Vector3d>> by_camera;  // u, v and depth of its keypoints with landmarks
  double median_depth = 0;
};

View view_of(const map::BundledMap& map, KeyframeId k, const SE3& T_world_rig) {
  const map::BundledKeyframe& keyframe = map.keyframe(k);
  View view;
  view.keyframe = k;
  view.time_ns = keyframe.frame->time_ns;
  view.T_world_rig = T_world_rig;
  view.by_camera.resize(map.rig().size());
  std::vector<double> depths;
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    const LandmarkId l = keyframe.landmarks[f];
    if (!l.valid()) continue;
    view.points.push_back(keyframe.T_rig_world * map.landmark(l).position);
    depths.push_back(view.points.back().norm());
    for (const frame::KeypointRef r : keyframe.frame->bundled.keypoints(FeatureId(f))) {
      const Eigen::Vector2f pixel = keyframe.frame->keypoints(r.camera).pixel[r.keypoint.index()];
      view.by_camera[r.camera.index()].emplace_back(pixel.x(), pixel.y(), depths.back());
    }
  }
  view.median_depth = depths.empty() ? 0 : median(std::move(depths));
  return view;
}

// Returns true if the view contains a point that was observed from `seen_from` (both in its frame). The known point
// closest to it in the image must have a similar depth, so that the point is not occluded.
bool shows(const camera::Rig& rig, const View& view, const Vector3d& point, const Vector3d& seen_from) {
  const double depth = point.norm(), depth_then = (point - seen_from).norm();
  if (depth > kZoom * depth_then || depth_then > kZoom * depth) return false;
  if (point.dot(point - seen_from) < std::cos(kMaxViewingAngle) * depth * depth_then) return false;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const auto pixel = rig.camera(c).project(rig.cam_from_rig(c) * point);
    if (!pixel || !rig.camera(c).contains(*pixel)) continue;
    double nearest = std::numeric_limits<double>::infinity(), there = 0;
    for (const Vector3d& known : view.by_camera[c]) {
      const double distance = (known.head<2>() - *pixel).squaredNorm();
      if (distance < nearest) {
        nearest = distance;
        there = known.z();
      }
    }
    if (there > 0.8 * depth && there < 1.25 * depth) return true;
  }
  return false;
}

// Returns the fraction of the landmarks of `old` that are visible in `now`.
double shared_share(const camera::Rig& rig, const View& now, const View& old) {
  const SE3 T_now_old = now.T_world_rig.inverse() * old.T_world_rig;
  if (T_now_old.translation().norm() > 2 * std::max(now.median_depth, old.median_depth)) return 0;
  int shared = 0;
  for (const Vector3d& p : old.points) shared += shows(rig, now, T_now_old * p, T_now_old.translation());
  return old.points.empty() ? 0 : static_cast<double>(shared) / static_cast<double>(old.points.size());
}

enum class Outcome { kRight, kWrong, kNoCandidate, kOtherCandidates, kRejected };
constexpr std::array kOutcomes = {"correct", "wrong", "no candidate", "other candidates", "rejected"};

class Recall {
 public:
  Recall(map::BundledMap map, const evaluation::Trajectory& truth, place::VocabularyPtr vocabulary,
         const system::Config& config, const Arguments& arguments)
      : map_(std::move(map)),
        recogniser_(std::move(vocabulary), config.looping.recognition),
        config_(config),
        arguments_(arguments) {
    for (const KeyframeId k : map_.keyframe_ids()) {
      const TimeNs time_ns = map_.keyframe(k).frame->time_ns;
      const auto pose = std::ranges::lower_bound(truth, time_ns - 1'000'000, {}, &evaluation::TimedPose::time_ns);
      if (pose == truth.end() || pose->time_ns > time_ns + 1'000'000) continue;
      views_.push_back(view_of(map_, k, pose->T_world_frame));
    }
  }

  // From the newest keyframe to the oldest, each in the map up to this keyframe.
  void run() {
    for (std::size_t i = views_.size(); i-- > 0;) {
      ask(i);
      map_.remove_keyframe(views_[i].keyframe);
    }
  }

  void print(const std::string& name) const {
    const int right = count_[0], wrong = count_[1];
    fmt::print("| {} | {} | {} | {} | {} | {:.3f} | {:.3f} |", name, views_.size(), revisits_, revisits_right_,
               right + wrong, right + wrong > 0 ? static_cast<double>(right) / (right + wrong) : 1.0,
               revisits_ > 0 ? static_cast<double>(revisits_right_) / revisits_ : 1.0);
    for (std::size_t o = 2; o < kOutcomes.size(); ++o) fmt::print(" {} {};", kOutcomes[o], missed_[o]);
    fmt::print(" |\n");
  }

 private:
  void ask(std::size_t i) {
    const View& now = views_[i];
    std::vector<KeyframeId> places;  // correct places
    const std::vector<map::Covisible> neighbours =
        looping::neighbours_of(map_, now.keyframe, config_.looping.recognition);
    double best = 0;
    for (std::size_t j = 0; j < i && old_enough(now, views_[j].time_ns); ++j) {
      if (std::ranges::binary_search(neighbours, views_[j].keyframe, {}, &map::Covisible::keyframe))
        continue;  // the place has always been in view
      const double share = shared_share(map_.rig(), now, views_[j]);
      if (share >= arguments_.overlap) places.push_back(views_[j].keyframe);
      best = std::max(best, share);
    }
    const Outcome outcome = answer(now, places);
    ++count_[static_cast<std::size_t>(outcome)];
    if (!places.empty()) {
      ++revisits_;
      revisits_right_ += outcome == Outcome::kRight;
      ++missed_[static_cast<std::size_t>(outcome)];
    }
    if (arguments_.detail) {
      fmt::print("{} at {:.2f} s: {} correct places, overlap {:.2f}: {} ({})\n", now.keyframe.value(),
                 1e-9 * static_cast<double>(now.time_ns), places.size(), best,
                 kOutcomes[static_cast<std::size_t>(outcome)], note_);
    }
  }

  bool old_enough(const View& now, TimeNs then_ns) const {
    return static_cast<double>(now.time_ns - then_ns) > 1e9 * arguments_.older_s;
  }

  Outcome answer(const View& now, const std::vector<KeyframeId>& places) {
    Outcome outcome = Outcome::kNoCandidate;
    note_.clear();
    for (const looping::PlaceCandidate& candidate : recogniser_.query_keyframe(map_, now.keyframe)) {
      const auto old = std::ranges::find(views_, candidate.keyframe, &View::keyframe);
      if (old == views_.end() || !old_enough(now, old->time_ns)) continue;
      const bool right_place = std::ranges::find(places, candidate.keyframe) != places.end();
      if (outcome != Outcome::kRejected) outcome = right_place ? Outcome::kRejected : Outcome::kOtherCandidates;
      looping::VerificationReport report;
      const Random random(static_cast<std::uint64_t>(config_.seed), "loop",
                          static_cast<std::uint64_t>(now.keyframe.value()));
      const auto place_match =
          looping::verify_place(map_, map_.rig_of(now.keyframe), *map_.keyframe(now.keyframe).frame, candidate.keyframe,
                                config_.looping.verification, config_.feature_model(), random, &report);
      note_ += fmt::format("{} score {:.3f} rejection {} matches {} inliers {} found {} of {}; ",
                           candidate.keyframe.value(), candidate.score, static_cast<int>(report.rejection),
                           report.matches, report.inliers, report.found, report.expected);
      if (place_match) return is_right(now, *old, *place_match) ? Outcome::kRight : Outcome::kWrong;
    }
    return outcome;
  }

  bool is_right(const View& now, const View& old, const looping::PlaceMatch& place_match) const {
    const SE3 T_old_now = map_.keyframe(old.keyframe).T_rig_world * place_match.T_rig_world.inverse();
    const SE3 error = (old.T_world_rig.inverse() * now.T_world_rig).inverse() * T_old_now;
    return error.translation().norm() < kMaxPositionError * now.median_depth &&
           error.rotation().angularDistance(Eigen::Quaterniond::Identity()) < kMaxRotationError;
  }

  map::BundledMap map_;
  looping::BagOfWordsRecogniser recogniser_;
  const system::Config& config_;
  const Arguments& arguments_;
  std::vector<View> views_;  // ordered by time
  std::array<int, 5> count_{}, missed_{};
  int revisits_ = 0, revisits_right_ = 0;
  std::string note_;
};

Status measure(const Arguments& arguments) {
  const auto config = cli::resolve_config(arguments.config);
  if (!config) return config.error();
  const auto saved = storage::read_map(arguments.map);
  if (!saved) return saved.error();
  const auto truth = evaluation::read_trajectory(arguments.truth);
  if (!truth) return truth.error();
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  Recall recall(saved->map, *truth, *vocabulary, *config, arguments);
  recall.run();
  recall.print(arguments.map);
  return {};
}

}  // namespace
}  // namespace bslam

int main(int argc, char** argv) {
  CLI::App app("precision and recall of place recognition over a map made without loop closing");
  bslam::Arguments arguments;
  app.add_option("map", arguments.map, "map written by `bslam run --no-loop --save-map`")->required();
  app.add_option("truth", arguments.truth, "true poses of camera 0, TUM")->required();
  app.add_option("--older", arguments.older_s, "minimum age of a place in seconds")->capture_default_str();
  app.add_option("--overlap", arguments.overlap,
                 "minimum fraction of the landmarks of a place that must be visible again")
      ->capture_default_str();
  app.add_flag("--detail", arguments.detail, "print a line for each keyframe");
  bslam::cli::add_config_options(app, arguments.config);
  CLI11_PARSE(app, argc, argv);
  const bslam::Status status = bslam::measure(arguments);
  if (!status) fmt::print(stderr, "{}\n", status.error().message());
  return status ? 0 : 2;
}
