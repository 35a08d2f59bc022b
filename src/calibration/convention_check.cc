#include "calibration/convention_check.h"

#include <algorithm>
#include <optional>

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

// Tolerance for the errors of calibration and feature localisation together, the larger of the two: the angles by which
// calibrations are wrong do not depend on the resolution.
constexpr double kTolerancePx = 2.0, kTolerance = 0.0025;  // rad
constexpr int kMinAgreeing = 25;
constexpr double kMinRatio = 0.4;     // minimum fraction of consistent matches; random matches reach a few per cent
constexpr double kClearly = 1.3;      // factor between numbers of consistent matches that counts as a clear difference
constexpr double kNoBaseline = 1e-6;  // metres
constexpr double kMinParallax = 0.005;  // rad, for the estimation of another pose

using estimators::bearing_pairs;
using estimators::PixelPair;

// Mutual best matches. No geometric constraint is used, since the geometry itself is tested.
std::vector<PixelPair> match(const feature::Detections& a, const feature::Detections& b) {
  std::vector<PixelPair> pairs;
  for (const feature::DescriptorMatch& m :
       feature::mutual_matches(a.descriptor, b.descriptor, [](std::size_t, std::size_t) { return true; })) {
    pairs.push_back({a.pixel[m.a.index()].cast<double>(), b.pixel[m.b.index()].cast<double>()});
  }
  return pairs;
}

// A convention applied to a pair: the calibrations of the first and second image, the transform between them, and
// whether both images are flipped left to right, and top to bottom.
struct Hypothesis {
  const camera::Camera *first, *second;
  SE3 T_second_first;
  bool left_to_right = false, top_to_bottom = false;
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
    case Convention::kMirrored:
      return {&ci, &cj, given, true};
    case Convention::kUpsideDown:
      return {&ci, &cj, given, true, true};
    case Convention::kSwappedInverse:
      break;
  }
  return {&cj, &ci, inverse.inverse()};
}

// Radians.
double tolerance_of(const camera::Camera& first, const camera::Camera& second) {
  return std::max(kTolerance, kTolerancePx * std::max(first.radians_per_pixel(), second.radians_per_pixel()));
}

// The pairs in images that are flipped as in the hypothesis.
std::vector<PixelPair> flipped(const Hypothesis& h, std::span<const PixelPair> pairs) {
  std::vector<PixelPair> out(pairs.begin(), pairs.end());
  for (PixelPair& pair : out) {
    if (h.left_to_right) pair.a.x() = h.first->width - 1 - pair.a.x();
    if (h.left_to_right) pair.b.x() = h.second->width - 1 - pair.b.x();
    if (h.top_to_bottom) pair.a.y() = h.first->height - 1 - pair.a.y();
    if (h.top_to_bottom) pair.b.y() = h.second->height - 1 - pair.b.y();
  }
  return out;
}

int count_agreeing(const Hypothesis& h, std::span<const PixelPair> pairs) {
  if (h.left_to_right || h.top_to_bottom)
    return count_agreeing({h.first, h.second, h.T_second_first}, flipped(h, pairs));
  const double tolerance = tolerance_of(*h.first, *h.second);
  const Eigen::Vector3d t = h.T_second_first.translation();
  const bool apart = t.norm() > kNoBaseline;
  const estimators::EpipolarPose pose{h.T_second_first.matrix3(), apart ? Eigen::Vector3d(t.normalized()) : t};
  const estimators::EpipolarAgreement found =
      estimators::epipolar_agreement(pose, bearing_pairs(pairs, *h.first, *h.second), tolerance);
  return apart ? found.all : found.all - found.with_depth;
}

// Difference between the estimated and the given pose of the second camera in the first.
OtherPose difference(const SE3& found, const SE3& given) {
  OtherPose out{.rotated_deg = geometry::degrees(geometry::so3_log((found * given.inverse()).rotation()).norm())};
  const Eigen::Vector3d lies = found.inverse().translation(), should_lie = given.inverse().translation();
  if (should_lie.norm() > kNoBaseline && lies.norm() > kNoBaseline)
    out.displaced_deg = geometry::degrees(geometry::angle_between(lies.normalized(), should_lie.normalized()));
  return out;
}

// The calibrations of two cameras of the rig, possibly others than this pair, that are consistent with most matches.
// Pairs with nearly the same arrangement as this one are not tried: they may only fit better because a camera was
// bumped.
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
  const auto found = static_cast<Convention>(best - evidence.agreeing.begin());
  const bool of_images = found == Convention::kMirrored || found == Convention::kUpsideDown;
  return of_images && evidence.fit_as_well(found, Convention::kSwapped) ? Convention::kSwapped : found;
}

}  // namespace

bool OtherPose::is_another_arrangement() const {
  constexpr double kRotation_deg = 5, kDisplacement_deg = 45;
  return rotated_deg > kRotation_deg || displaced_deg > kDisplacement_deg;
}

bool PairEvidence::fit_as_well(Convention a, Convention b) const {
  constexpr double kAsMany = 0.95;
  const auto [less, more] = std::minmax({with(a), with(b)});
  return less >= kAsMany * more;
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
  if (evidence.verdict && fitting >= kGoodShare * evidence.matches) return evidence;
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

image::Image mirrored(const image::ImageView& image) {
  image::Image out = image::copy_of(image);
  for (int y = 0; y < out.height(); ++y) std::reverse(out.row(y), out.row(y) + out.width());
  return out;
}

// The keypoints of a camera in mirrored images. The mask, drawn for the images as they are, is mirrored as well.
std::vector<View> mirrored_views(const camera::Rig& rig, std::size_t camera, std::span<const image::ImageBundle> frames,
                                 const image::Image& mask) {
  feature::Extractor extractor({});
  image::Pyramid pyramid;
  const image::Image mirrored_mask = mirrored(mask.view());
  std::vector<View> out(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const image::CameraImage& image = frames[k].images[camera];
    if (image.state != image::ImageState::kPresent) continue;
    out[k].time_ns = image.time_ns;
    extractor.extract(mirrored(image.view()).view(), mirrored_mask.view(), rig.camera(camera), pyramid,
                      out[k].keypoints);
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
                                            std::span<const image::Image> masks,
                                            const std::vector<std::vector<View>>& views) {
  constexpr int kMinMatches = 100, kTimes = 3;
  for (const std::size_t c : {pair.second, pair.first}) {
    const std::vector<View> reversed = mirrored_views(rig, c, frames, masks[c]);
    const PairEvidence again = judge_views(rig, pair.first, pair.second, c == pair.first ? reversed : views[pair.first],
                                           c == pair.second ? reversed : views[pair.second]);
    const int agreeing = again.agreeing[0];
    if (again.verdict == Convention::kAsGiven && agreeing >= kMinMatches && agreeing >= kGoodShare * again.matches &&
        agreeing >= kTimes * pair.agreeing[0])
      return MirroredCamera{c, again.matches, agreeing};
  }
  return std::nullopt;
}

}  // namespace

std::vector<PairEvidence> check_conventions(const camera::Rig& rig, std::span<const image::ImageBundle> frames,
                                            std::span<const image::Image> masks) {
  const std::vector<std::vector<View>> views = extract_views(rig, frames, masks);
  std::vector<PairEvidence> evidence;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      PairEvidence& pair = evidence.emplace_back(judge_views(rig, i, j, views[i], views[j]));
      if (!pair.verdict && pair.instants > 0 && pair.overlap >= kSomeOverlap)
        pair.mirrored = find_mirrored(rig, pair, frames, masks, views);
    }
  }
  return evidence;
}

}  // namespace bslam::calibration
