#include "calibration/convention_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "calibration/camera_views.h"
#include "estimators/pair_rotation.h"
#include "feature/descriptor_matching.h"
#include "feature/extractor.h"
#include "frame/capture_times.h"
#include "geometry/so3.h"
#include "geometry/triangulation.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;

constexpr int kMaxHamming = 60;       // bits; largest descriptor distance of a match
constexpr double kRatio = 0.85;       // largest ratio of best to second best descriptor distance
constexpr double kTolerancePx = 2.0;  // of calibration and feature localisation together
constexpr int kMinAgreeing = 25;
constexpr double kMinRatio = 0.4;     // minimum fraction of consistent matches; random matches reach a few per cent
constexpr int kMany = 300;            // matches; with more than these some convention is expected to fit
constexpr double kGoodRatio = 0.6;    // if the fraction of consistent matches is smaller, another pose is searched for
constexpr double kClearly = 1.3;      // factor between numbers of consistent matches that counts as a clear difference
constexpr double kNoBaseline = 1e-6;  // metres
constexpr double kMinParallax = 0.005;  // rad, for the estimation of another pose

using estimators::bearing_pairs;
using estimators::PixelPair;

// Mutual best matches. No geometric constraint is used, since the geometry itself is tested.
std::vector<PixelPair> match(const feature::Detections& a, const feature::Detections& b) {
  std::vector<PixelPair> pairs;
  for (const feature::DescriptorMatch& m : feature::mutual_matches(a.descriptor, b.descriptor, kMaxHamming, kRatio,
                                                                   [](std::size_t, std::size_t) { return true; })) {
    pairs.push_back({a.pixel[m.a.index()].cast<double>(), b.pixel[m.b.index()].cast<double>()});
  }
  return pairs;
}

// A convention applied to a pair: the calibrations of the first and second image, and the transform between them.
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
  const estimators::EpipolarPose pose{h.T_second_first.matrix3(), apart ? Eigen::Vector3d(t.normalized()) : t};
  const estimators::EpipolarAgreement found =
      estimators::epipolar_agreement(pose, bearing_pairs(pairs, *h.first, *h.second), tolerance);
  return apart ? found.all : found.all - found.with_depth;
}

// How much the pose of the second camera in the first one differs from the given one.
OtherPose difference(const SE3& found, const SE3& given) {
  OtherPose out{.rotated_deg = geometry::degrees(geometry::so3_log((found * given.inverse()).rotation()).norm())};
  const Eigen::Vector3d lies = found.inverse().translation(), should_lie = given.inverse().translation();
  if (should_lie.norm() > kNoBaseline && lies.norm() > kNoBaseline)
    out.displaced_deg = geometry::degrees(geometry::angle_between(lies.normalized(), should_lie.normalized()));
  return out;
}

// The calibrations of two cameras, not just those of the pair, that are consistent with most matches. Those of pairs
// that are arranged much like this one are not tried: they may fit better only because a camera was knocked.
std::optional<OtherCalibrations> other_calibrations(const camera::Rig& rig, std::size_t i, std::size_t j,
                                                    std::span<const PixelPair> pairs) {
  const SE3 given = rig.cam_from_rig(j) * rig.rig_from_cam(i);
  OtherCalibrations best;
  for (std::size_t k = 0; k < rig.size(); ++k) {
    for (std::size_t l = 0; l < rig.size(); ++l) {
      if (k == l || (k == i && l == j) || (k == j && l == i)) continue;
      const Hypothesis hypothesis = hypothesis_of(Convention::kAsGiven, rig, k, l);
      if (!difference(hypothesis.T_second_first, given).is_another_arrangement()) continue;
      const int agreeing = count_agreeing(hypothesis, pairs);
      if (agreeing > best.agreeing) best = {{rig.camera(k).name, rig.camera(l).name}, agreeing};
    }
  }
  if (best.agreeing < kMinAgreeing || best.agreeing < kMinRatio * static_cast<double>(pairs.size()))
    return std::nullopt;
  return best;
}

// The relative pose of camera j estimated from the matches of all frames, independent of the calibrated one.
std::optional<OtherPose> other_pose(const camera::Rig& rig, std::size_t i, std::size_t j,
                                    std::span<const PixelPair> pairs) {
  const camera::Camera &ci = rig.camera(i), &cj = rig.camera(j);
  const std::vector<estimators::BearingPair> all = bearing_pairs(pairs, ci, cj);
  const int min_inliers = std::max(kMinAgreeing, static_cast<int>(kMinRatio * static_cast<double>(all.size())));
  const estimators::RelativePoseOptions options{.iterations = 2000,
                                                .inlier_angle = tolerance_of(ci, cj),
                                                .min_parallax = kMinParallax,
                                                .min_inliers = min_inliers};
  const auto found = estimators::relative_pose(all, options, Random(1, "extrinsics check"));
  if (!found) return std::nullopt;
  const SE3 given = rig.cam_from_rig(j) * rig.rig_from_cam(i);
  OtherPose out = difference(found->T_b_a, given);
  out.agreeing = found->num_inliers;
  return out;
}

std::optional<Convention> verdict_of(const PairEvidence& evidence) {
  const auto best = std::max_element(evidence.agreeing.begin(), evidence.agreeing.end());  // the first among equal ones
  if (*best < kMinAgreeing || *best < kMinRatio * evidence.matches) return std::nullopt;
  if (*best < kClearly * evidence.agreeing[0]) return Convention::kAsGiven;
  return static_cast<Convention>(best - evidence.agreeing.begin());
}

}  // namespace

bool OtherPose::is_another_arrangement() const {
  constexpr double kRotation_deg = 5, kDisplacement_deg = 45;
  return rotated_deg > kRotation_deg || displaced_deg > kDisplacement_deg;
}

std::string_view convention_in_words(Convention convention) {
  switch (convention) {
    case Convention::kAsGiven:
      return "as given";
    case Convention::kInverse:
      return "with every transform inverted (T_cam_body instead of T_body_cam)";
    case Convention::kPairInverse:
      return "with the transform between the two inverted, or the two cameras exchanged";
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
  PairEvidence evidence{.first = i,
                        .second = j,
                        .instants = static_cast<int>(instants),
                        .overlap = std::max(rig.overlap_share(i, j), rig.overlap_share(j, i))};
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
  if (evidence.verdict && fitting >= kGoodRatio * evidence.matches) return evidence;
  const auto clearly_better = [&](auto found) {
    if (found && found->agreeing < kClearly * fitting) found.reset();
    return found;
  };
  evidence.exchanged = clearly_better(other_calibrations(rig, i, j, all));
  if (!evidence.exchanged) evidence.other = clearly_better(other_pose(rig, i, j, all));
  if (evidence.exchanged || evidence.other) evidence.verdict.reset();
  return evidence;
}

namespace {

// The keypoints of a camera in mirrored images.
std::vector<View> mirrored_views(const camera::Rig& rig, std::size_t camera,
                                 std::span<const image::ImageBundle> frames) {
  feature::Extractor extractor({});
  image::Pyramid pyramid;
  std::vector<View> out(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const image::CameraImage& image = frames[k].images[camera];
    if (image.state != image::ImageState::kPresent) continue;
    image::Image reversed = image::copy_of(image.view());
    for (int y = 0; y < reversed.height(); ++y) std::reverse(reversed.row(y), reversed.row(y) + reversed.width());
    out[k].time_ns = image.time_ns;
    extractor.extract(reversed.view(), {}, rig.camera(camera), pyramid, out[k].keypoints);
  }
  return out;
}

PairEvidence judge_views(const camera::Rig& rig, std::size_t i, std::size_t j, const std::vector<View>& first,
                         const std::vector<View>& second) {
  std::vector<feature::Detections> of_i, of_j;
  for (std::size_t k = 0; k < first.size(); ++k) {
    const View &a = first[k], &b = second[k];
    if (!a.time_ns || !b.time_ns || std::abs(*a.time_ns - *b.time_ns) > frame::kTogetherNs) continue;
    of_i.push_back(a.keypoints);
    of_j.push_back(b.keypoints);
  }
  return judge_pair(rig, i, j, of_i, of_j);
}

// Finds which of the two cameras has mirrored images. Scenes may be symmetric, so that the geometry must agree as well.
std::optional<MirroredCamera> find_mirrored(const camera::Rig& rig, const PairEvidence& pair,
                                            std::span<const image::ImageBundle> frames,
                                            const std::vector<std::vector<View>>& views) {
  constexpr int kMinMatches = 100, kTimes = 3;
  for (const std::size_t c : {pair.second, pair.first}) {
    const std::vector<View> reversed = mirrored_views(rig, c, frames);
    const PairEvidence again = judge_views(rig, pair.first, pair.second, c == pair.first ? reversed : views[pair.first],
                                           c == pair.second ? reversed : views[pair.second]);
    const int agreeing = again.agreeing[0];
    if (again.verdict == Convention::kAsGiven && agreeing >= kMinMatches && agreeing >= kGoodRatio * again.matches &&
        agreeing >= kTimes * pair.agreeing[0])
      return MirroredCamera{c, again.matches, agreeing};
  }
  return std::nullopt;
}

}  // namespace

std::vector<PairEvidence> check_conventions(const camera::Rig& rig, std::span<const image::ImageBundle> frames,
                                            std::span<const image::Image> masks) {
  constexpr double kSomeOverlap = 0.2;
  const std::vector<std::vector<View>> views = extract_views(rig, frames, masks);
  std::vector<PairEvidence> evidence;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      PairEvidence& pair = evidence.emplace_back(judge_views(rig, i, j, views[i], views[j]));
      if (!pair.verdict && pair.instants > 0 && pair.overlap >= kSomeOverlap)
        pair.mirrored = find_mirrored(rig, pair, frames, views);
    }
  }
  return evidence;
}

std::string describe_pair(const PairEvidence& pair) {
  const auto agreeing = [&](Convention c) { return pair.agreeing[static_cast<std::size_t>(c)]; };
  if (pair.mirrored) {
    return fmt::format(
        "{} of {} matches are consistent with the calibration if the images of camera {} are mirrored left to "
        "right; {} with it as given",
        pair.mirrored->agreeing, pair.mirrored->matches, pair.mirrored->camera, agreeing(Convention::kAsGiven));
  }
  if (pair.exchanged) {
    return fmt::format(
        "{} of {} matches are consistent with the calibrations of {} and {} in place of those of the two cameras; {} "
        "with the calibration as given",
        pair.exchanged->agreeing, pair.matches, pair.exchanged->cameras[0], pair.exchanged->cameras[1],
        agreeing(Convention::kAsGiven));
  }
  if (pair.other) {
    return fmt::format(
        "{} of {} matches are consistent with a pose of the second camera that is rotated by {:.1f} degrees from the "
        "calibrated one, with a baseline whose direction differs by {:.0f} degrees; {} with the calibration as given",
        pair.other->agreeing, pair.matches, pair.other->rotated_deg, pair.other->displaced_deg,
        agreeing(Convention::kAsGiven));
  }
  if (pair.instants == 0) return "not tested: no images taken at the same time, so there is nothing to compare";
  if (!pair.verdict && pair.matches > kMany)
    return fmt::format("{} matches, but too few are consistent with any convention", pair.matches);
  if (!pair.verdict)
    return fmt::format("not tested: too few matches for a decision ({}); the calibrated views overlap by {:.0f} %",
                       pair.matches, 100 * pair.overlap);
  std::string text = fmt::format("{} of {} matches are consistent with the calibration {}", agreeing(*pair.verdict),
                                 pair.matches, convention_in_words(*pair.verdict));
  if (*pair.verdict != Convention::kAsGiven)
    return text + fmt::format("; {} with it as given", agreeing(Convention::kAsGiven));
  if (agreeing(Convention::kAsGiven) < kGoodRatio * pair.matches)
    text += "; this is few: many matches are wrong, or the intrinsics are inaccurate";
  return text;
}

namespace {

// For rigs without a fault: the pairs and cameras that could not be tested.
std::string unjudged(std::span<const PairEvidence> evidence) {
  std::size_t pairs = 0;
  std::set<std::size_t> cameras, judged;
  for (const PairEvidence& pair : evidence) {
    pairs += pair.verdict ? 0 : 1;
    for (const std::size_t c : {pair.first, pair.second}) (pair.verdict ? judged : cameras).insert(c);
  }
  std::erase_if(cameras, [&](std::size_t c) { return judged.contains(c); });
  if (pairs == 0) return "";
  return fmt::format(
      "; {} of {} pairs could not be tested{}", pairs, evidence.size(),
      cameras.empty() ? "" : fmt::format(", among them all pairs of camera {}", fmt::join(cameras, ", ")));
}

// Pairs that should have been tested, since the calibrated views overlap.
std::string warning_of_untested(std::span<const PairEvidence> evidence) {
  constexpr double kMuchOverlap = 0.4;  // opposite fisheyes with less hardly match at the edges of their views
  std::vector<std::string> untested;
  std::size_t common = 0;
  for (const PairEvidence& pair : evidence) {
    if (pair.overlap < kMuchOverlap) continue;
    ++common;
    if (!pair.verdict && !pair.exchanged && !pair.other && !pair.mirrored)
      untested.push_back(fmt::format("{} and {}", pair.first, pair.second));
  }
  if (untested.empty()) return "";
  return fmt::format("warning: {} of {} pairs with much overlap could not be tested: cameras {}\n", untested.size(),
                     common, fmt::join(untested, ", "));
}

}  // namespace

std::string describe_evidence(std::span<const PairEvidence> evidence) {
  std::string text = "test against the images:\n";
  std::set<std::size_t> mirrored;
  std::map<Convention, std::vector<std::string>> mistakes;  // pairs
  int fitting = 0, elsewhere = 0, exchanged = 0;
  for (const PairEvidence& pair : evidence) {
    text += fmt::format("  cameras {} and {}: {}\n", pair.first, pair.second, describe_pair(pair));
    if (pair.mirrored) mirrored.insert(pair.mirrored->camera);
    elsewhere += pair.other ? 1 : 0;
    exchanged += pair.exchanged ? 1 : 0;
    if (pair.verdict == Convention::kAsGiven) ++fitting;
    if (pair.verdict && pair.verdict != Convention::kAsGiven) {
      mistakes[*pair.verdict].push_back(fmt::format("{} and {}", pair.first, pair.second));
    }
  }
  for (const std::size_t camera : mirrored)
    text += fmt::format("warning: the images of camera {} are mirrored left to right\n", camera);
  if (!mistakes.empty()) {
    const auto most = std::ranges::max_element(mistakes, {}, [](const auto& mistake) { return mistake.second.size(); });
    const auto& pairs = most->second;
    const std::string others =
        fitting > 0 ? fmt::format("; {} of {} pairs are consistent as given", fitting, evidence.size()) : "";
    return text +
           fmt::format(
               "warning: the images of cameras {} contradict the extrinsics; they are consistent with them {}{}\n",
               fmt::join(pairs, ", "), convention_in_words(most->first), others);
  }
  if (exchanged > 0)
    return text + "warning: the images contradict the extrinsics; they are consistent with exchanged cameras\n";
  if (elsewhere > 0) return text + "warning: the images contradict the extrinsics, and no common mistake explains it\n";
  text += warning_of_untested(evidence);
  if (fitting == 0) return text + "  the extrinsics could not be tested\n";
  text += "  the extrinsics are consistent with the images" + unjudged(evidence) + "\n";
  return text +
         "  focal lengths and distortion are hardly tested by pairs of images: `bslam run` estimates them from the "
         "motion of the rig\n";
}

}  // namespace bslam::calibration
