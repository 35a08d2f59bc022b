#include "session/extrinsics_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "dataset/frame_reader.h"
#include "feature/extractor.h"
#include "feature/hamming.h"
#include "frame/capture_times.h"
#include "geometry/so3.h"
#include "geometry/triangulation.h"
#include "image_files/image_file.h"
#include "solver/epipolar.h"

namespace bslam::session {
namespace {

using geometry::SE3;

constexpr int kFrames = 6;            // of the data set, spread over it
constexpr int kFarthest = 60;         // bits between descriptors of one point
constexpr double kRatio = 0.85;       // to the second best
constexpr double kTolerancePx = 2.0;  // of a calibration and its features
constexpr int kLeastAgreeing = 25;
constexpr double kLeastShare = 0.4;       // of the matches; chance reaches some per cent
constexpr int kMany = 300;                // matches: enough to expect that some convention fits
constexpr double kMost = 0.6;             // of the matches: fewer, and another pose may fit more
constexpr double kClearly = 1.3;          // times more than as given
constexpr double kNoBaseline = 1e-6;      // metres
constexpr double kLeastParallax = 0.005;  // radians, of the matches another pose is found from

// For every descriptor of `a` its best in `b`, or -1.
std::vector<int> best_matches(const feature::Detections& a, const feature::Detections& b) {
  std::vector<int> best(a.size(), -1);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int least = 257, second = 257;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int distance = feature::hamming(a.descriptor[i], b.descriptor[j]);
      if (distance < least) {
        second = least, least = distance;
        best[i] = static_cast<int>(j);
      } else {
        second = std::min(second, distance);
      }
    }
    if (least > kFarthest || least > kRatio * second) best[i] = -1;
  }
  return best;
}

struct PixelPair {
  Eigen::Vector2d a, b;
};

// Mutual best matches, without any geometry: it is what is to be tested.
std::vector<PixelPair> match(const feature::Detections& a, const feature::Detections& b) {
  const std::vector<int> forward = best_matches(a, b), backward = best_matches(b, a);
  std::vector<PixelPair> pairs;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (forward[i] < 0) continue;
    const auto j = static_cast<std::size_t>(forward[i]);
    if (backward[j] == static_cast<int>(i)) pairs.push_back({a.pixel[i].cast<double>(), b.pixel[j].cast<double>()});
  }
  return pairs;
}

// Under a convention: which calibration the first and the second image have, and the transform between them.
struct Hypothesis {
  const camera::Camera *first, *second;
  SE3 T_second_first;
};

Hypothesis hypothesis_of(Convention convention, const camera::Rig& rig, std::size_t i, std::size_t j) {
  const camera::Camera &ci = rig.camera(i), &cj = rig.camera(j);
  const SE3 given = rig.cam_from_rig(j) * rig.rig_from_cam(i);
  const SE3 inverse = rig.body_from_cam(j) * rig.body_from_cam(i).inverse();
  switch (convention) {
    case Convention::kAsGiven:
      return {&ci, &cj, given};
    case Convention::kInverse:
      return {&ci, &cj, inverse};
    case Convention::kPairInverse:
      return {&ci, &cj, given.inverse()};
    case Convention::kSwapped:
      return {&cj, &ci, given.inverse()};
    case Convention::kSwappedInverse:
      break;
  }
  return {&cj, &ci, inverse.inverse()};
}

// Radians.
double tolerance_of(const camera::Camera& first, const camera::Camera& second) {
  return kTolerancePx * std::max(first.radians_per_pixel(), second.radians_per_pixel());
}

int count_agreeing(const Hypothesis& h, std::span<const PixelPair> pairs) {
  const double tolerance = tolerance_of(*h.first, *h.second);
  const Eigen::Vector3d t = h.T_second_first.translation();
  const bool apart = t.norm() > kNoBaseline;
  const solver::EpipolarPose pose{h.T_second_first.matrix3(), apart ? Eigen::Vector3d(t.normalized()) : t};
  int agreeing = 0;
  for (const PixelPair& pair : pairs) {
    const auto a = h.first->unproject(pair.a), b = h.second->unproject(pair.b);
    if (!a || !b) continue;
    const bool far = geometry::angle_between(pose.R_b_a * *a, *b) < tolerance;  // in front or behind cannot be told
    agreeing +=
        far || (apart && solver::epipolar_angle(pose, {*a, *b}) < tolerance && solver::in_front_of_both(pose, {*a, *b}))
            ? 1
            : 0;
  }
  return agreeing;
}

// The pose of camera j that the matches of all frames fit, calibrated or not.
std::optional<OtherPose> other_pose(const camera::Rig& rig, std::size_t i, std::size_t j,
                                    std::span<const PixelPair> pairs) {
  const camera::Camera &ci = rig.camera(i), &cj = rig.camera(j);
  std::vector<solver::BearingPair> bearings;
  for (const PixelPair& pair : pairs) {
    const auto a = ci.unproject(pair.a), b = cj.unproject(pair.b);
    if (a && b) bearings.push_back({*a, *b});
  }
  const int least = std::max(kLeastAgreeing, static_cast<int>(kLeastShare * static_cast<double>(bearings.size())));
  const solver::RelativePoseOptions options{
      .iterations = 2000, .inlier_angle = tolerance_of(ci, cj), .min_parallax = kLeastParallax, .min_inliers = least};
  const auto found = solver::relative_pose(bearings, options, Random(1, "extrinsics check"));
  if (!found) return std::nullopt;
  const SE3 given = rig.cam_from_rig(j) * rig.rig_from_cam(i);
  OtherPose out{.agreeing = found->num_inliers};
  out.turned_deg = geometry::degrees(geometry::so3_log((found->T_b_a * given.inverse()).rotation()).norm());
  const Eigen::Vector3d lies = found->T_b_a.inverse().translation(), should_lie = given.inverse().translation();
  if (should_lie.norm() > kNoBaseline)
    out.displaced_deg = geometry::degrees(geometry::angle_between(lies, should_lie.normalized()));
  return out;
}

std::optional<Convention> verdict_of(const PairEvidence& evidence) {
  const auto best = std::max_element(evidence.agreeing.begin(), evidence.agreeing.end());  // the first of equals
  if (*best < kLeastAgreeing || *best < kLeastShare * evidence.matches) return std::nullopt;
  if (*best < kClearly * evidence.agreeing[0]) return Convention::kAsGiven;
  return static_cast<Convention>(best - evidence.agreeing.begin());
}

}  // namespace

std::string_view convention_in_words(Convention convention) {
  switch (convention) {
    case Convention::kAsGiven:
      return "as given";
    case Convention::kInverse:
      return "with every transform inverted (T_cam_body is given, T_body_cam meant)";
    case Convention::kPairInverse:
      return "with the transform between the two inverted, or the two exchanged";
    case Convention::kSwapped:
      return "with the two cameras exchanged";
    case Convention::kSwappedInverse:
      break;
  }
  return "with the two cameras exchanged and every transform inverted";
}

PairEvidence judge_pair(const camera::Rig& rig, std::size_t i, std::size_t j, std::span<const feature::Detections> of_i,
                        std::span<const feature::Detections> of_j) {
  const std::size_t instants = std::min(of_i.size(), of_j.size());
  PairEvidence evidence{.first = i, .second = j, .instants = static_cast<int>(instants)};
  std::vector<PixelPair> all;
  for (std::size_t frame = 0; frame < instants; ++frame) {
    const std::vector<PixelPair> pairs = match(of_i[frame], of_j[frame]);
    all.insert(all.end(), pairs.begin(), pairs.end());
    for (int c = 0; c < kConventions; ++c) {
      const Hypothesis hypothesis = hypothesis_of(static_cast<Convention>(c), rig, i, j);
      evidence.agreeing[static_cast<std::size_t>(c)] += count_agreeing(hypothesis, pairs);
    }
  }
  evidence.matches = static_cast<int>(all.size());
  evidence.verdict = verdict_of(evidence);
  const int fitting = *std::ranges::max_element(evidence.agreeing);
  if (evidence.verdict && fitting >= kMost * evidence.matches) return evidence;
  evidence.other = other_pose(rig, i, j, all);
  if (evidence.other && evidence.other->agreeing < kClearly * fitting) evidence.other.reset();
  if (evidence.other) evidence.verdict.reset();
  return evidence;
}

namespace {

struct View {
  TimeNs time_ns = 0;
  feature::Detections keypoints;  // empty without an image
};

// By camera and frame.
std::vector<std::vector<View>> look(const dataset::Dataset& dataset, std::span<const image::Image> masks) {
  const camera::Rig& rig = dataset.rig;
  std::vector<std::vector<View>> views(rig.size());
  feature::Extractor extractor({});
  const std::size_t frames = std::min<std::size_t>(kFrames, dataset.frames.size());
  for (std::size_t k = 0; k < frames; ++k) {
    const image::ImageBundle bundle = dataset::read_frame(dataset, (2 * k + 1) * dataset.frames.size() / (2 * frames));
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const image::CameraImage& image = bundle.images[c];
      View& view = views[c].emplace_back();
      if (image.state != image::ImageState::kPresent) continue;
      view.time_ns = image.time_ns;
      image::Pyramid pyramid;
      extractor.extract(image.image.view(), masks[c].view(), rig.camera(c), pyramid, view.keypoints);
    }
  }
  return views;
}

}  // namespace

Result<std::vector<PairEvidence>> check_extrinsics(const dataset::Dataset& dataset) {
  const camera::Rig& rig = dataset.rig;
  const auto masks = image_files::read_masks(rig);
  if (!masks) return masks.error();
  const std::vector<std::vector<View>> views = look(dataset, *masks);
  std::vector<PairEvidence> evidence;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      std::vector<feature::Detections> of_i, of_j;
      for (std::size_t k = 0; k < views[i].size(); ++k) {
        if (std::abs(views[i][k].time_ns - views[j][k].time_ns) > frame::kTogetherNs) continue;
        of_i.push_back(views[i][k].keypoints);
        of_j.push_back(views[j][k].keypoints);
      }
      evidence.push_back(judge_pair(rig, i, j, of_i, of_j));
    }
  }
  return evidence;
}

namespace {

std::string describe(const PairEvidence& pair) {
  const auto agreeing = [&](Convention c) { return pair.agreeing[static_cast<std::size_t>(c)]; };
  if (pair.other) {
    return fmt::format(
        "{} of {} matches fit the second turned by {:.1f} degrees from how it is given, in a direction {:.0f} degrees "
        "from the given one; {} as given",
        pair.other->agreeing, pair.matches, pair.other->turned_deg, pair.other->displaced_deg,
        agreeing(Convention::kAsGiven));
  }
  if (pair.instants == 0) return "never taken together: nothing to compare";
  if (!pair.verdict && pair.matches > kMany)
    return fmt::format("{} matches, and no convention fits enough of them", pair.matches);
  if (!pair.verdict) return fmt::format("too little in common to tell ({} matches)", pair.matches);
  std::string text =
      fmt::format("{} of {} matches fit {}", agreeing(*pair.verdict), pair.matches, convention_in_words(*pair.verdict));
  if (*pair.verdict != Convention::kAsGiven) return text + fmt::format(", {} as given", agreeing(Convention::kAsGiven));
  if (agreeing(Convention::kAsGiven) < kMost * pair.matches)
    text += "; few: many wrong matches, or intrinsics that are a little off";
  return text;
}

// Where none is at fault: what nothing was found out about.
std::string unjudged(std::span<const PairEvidence> evidence) {
  std::size_t pairs = 0;
  std::set<std::size_t> cameras, judged;
  for (const PairEvidence& pair : evidence) {
    pairs += pair.verdict ? 0 : 1;
    for (const std::size_t c : {pair.first, pair.second}) (pair.verdict ? judged : cameras).insert(c);
  }
  std::erase_if(cameras, [&](std::size_t c) { return judged.contains(c); });
  if (pairs == 0) return "";
  return fmt::format("; {} of {} pairs could not be judged{}", pairs, evidence.size(),
                     cameras.empty() ? "" : fmt::format(": nothing is known of camera {}", fmt::join(cameras, ", ")));
}

}  // namespace

std::string describe_evidence(std::span<const PairEvidence> evidence) {
  std::string text = "against the images:\n";
  std::map<Convention, std::vector<std::string>> slips;  // pairs
  int fitting = 0, elsewhere = 0;
  for (const PairEvidence& pair : evidence) {
    text += fmt::format("  {} and {}: {}\n", pair.first, pair.second, describe(pair));
    elsewhere += pair.other ? 1 : 0;
    if (pair.verdict == Convention::kAsGiven) ++fitting;
    if (pair.verdict && pair.verdict != Convention::kAsGiven) {
      slips[*pair.verdict].push_back(fmt::format("{} and {}", pair.first, pair.second));
    }
  }
  if (!slips.empty()) {
    const auto most = std::ranges::max_element(slips, {}, [](const auto& slip) { return slip.second.size(); });
    const auto& pairs = most->second;
    const std::string others =
        fitting > 0 ? fmt::format("; {} of {} pairs fit as given", fitting, evidence.size()) : "";
    return text + fmt::format("warning: the images of cameras {} do not fit the extrinsics; they fit {}{}\n",
                              fmt::join(pairs, ", "), convention_in_words(most->first), others);
  }
  if (elsewhere > 0) return text + "warning: the images do not fit the extrinsics, nor any common slip of them\n";
  if (fitting == 0) return text + "  nothing can be said of the extrinsics\n";
  return text + "  the extrinsics fit as given" + unjudged(evidence) + "\n";
}

}  // namespace bslam::session
