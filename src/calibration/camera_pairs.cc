#include "calibration/camera_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "camera/view_overlap.h"
#include "frame/capture_times.h"

namespace bslam::calibration {
namespace {

// Per image; images with fewer show a dark or blank scene and are not evaluated.
constexpr std::size_t kMinKeypoints = 100;
constexpr double kMuchOverlap = 0.4;  // overlap above which some features are expected to be matched
constexpr double kHardlyAny = 0.02;   // share of matched keypoints; 0.1 to 0.7 is usual
constexpr double kEnough = 0.2;       // with this share a pair with much overlap needs no further test
constexpr int kMinKeyframes = 2;      // minimum number of keyframes to report that hardly anything was matched
constexpr std::size_t kImagePairs = 24, kImagesPerPair = 8;  // maximum numbers of images that are matched again
constexpr double kMinExplained = 0.4;                        // share of matches that the other arrangement explains
constexpr double kClearly = 2;  // minimum ratio to the number of matches that the calibration explains

const frame::CameraFrame& image_of(const map::BundledMap& map, KeyframeId k, std::size_t camera) {
  return map.keyframe(k).frame->cameras[camera];
}

// The keyframes in which both cameras have an image of the same time with enough keypoints. `shift_ns`: change of the
// times of camera i relative to those of camera j by the calibration of the map.
std::vector<KeyframeId> common_keyframes(const map::BundledMap& map, std::span<const KeyframeId> keyframes,
                                         std::size_t i, std::size_t j, TimeNs shift_ns = 0) {
  std::vector<KeyframeId> out;
  for (const KeyframeId k : keyframes) {
    const frame::CameraFrame &a = image_of(map, k, i), &b = image_of(map, k, j);
    if (std::min(a.keypoints.size(), b.keypoints.size()) < kMinKeypoints) continue;
    if (std::abs(a.time_ns - b.time_ns - shift_ns) <= frame::kTogetherNs) out.push_back(k);
  }
  return out;
}

// The number of features of a keyframe that have a keypoint in both cameras.
int matched_in(const frame::Bundled& bundled, std::size_t i, std::size_t j) {
  int matched = 0;
  for (std::size_t f = 0; f < bundled.num_matched(); ++f) {
    int found = 0;
    for (const frame::KeypointRef& ref : bundled.keypoints(FeatureId(f)))
      found += ref.camera.index() == i || ref.camera.index() == j;
    matched += found == 2;
  }
  return matched;
}

feature::Detections keypoints_of(const map::BundledMap& map, KeyframeId k, std::size_t camera) {
  const feature::Keypoints& keypoints = image_of(map, k, camera).keypoints;
  feature::Detections out;
  out.pixel = keypoints.pixel.copy();
  out.descriptor = keypoints.descriptor.copy();
  return out;
}

// The keypoints of both cameras in keyframes spread over `keyframes`.
struct Views {
  std::vector<feature::Detections> first, second;
};

Views spread_views(const map::BundledMap& map, std::span<const KeyframeId> keyframes, std::size_t i, std::size_t j,
                   std::size_t most) {
  Views out;
  const std::size_t count = std::min(most, keyframes.size());
  for (std::size_t n = 0; n < count; ++n) {
    const KeyframeId k = keyframes[(2 * n + 1) * keyframes.size() / (2 * count)];
    out.first.push_back(keypoints_of(map, k, i));
    out.second.push_back(keypoints_of(map, k, j));
  }
  return out;
}

// The parts of the images in which each camera observes features, by all keyframes.
std::vector<camera::SampledView> used_views(const map::BundledMap& map, std::span<const KeyframeId> keyframes,
                                            std::size_t first_camera, const camera::Rig& rig) {
  std::vector<camera::SampledView> out;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    camera::UsedView used(rig.camera(c));
    for (const KeyframeId k : keyframes) {
      for (const Eigen::Vector2f& pixel : image_of(map, k, first_camera + c).keypoints.pixel)
        used.add(pixel.cast<double>());
    }
    out.emplace_back(rig.camera(c), used);
  }
  return out;
}

// The pair without evidence.
CameraPair count_features(const map::BundledMap& map, std::span<const KeyframeId> keyframes, std::size_t first_camera,
                          const camera::Rig& rig, std::span<const camera::SampledView> views, std::size_t i,
                          std::size_t j) {
  const geometry::SE3 T_j_i = rig.cam_from_rig(j) * rig.rig_from_cam(i);
  const double of_i = camera::overlap_share(views[i], views[j], T_j_i);
  const double of_j = camera::overlap_share(views[j], views[i], T_j_i.inverse());
  const std::size_t a = first_camera + i, b = first_camera + j;
  CameraPair pair{
      .first = i, .second = j, .overlap = std::max(of_i, of_j), .keyframes = static_cast<int>(keyframes.size())};
  for (const KeyframeId k : keyframes) {
    pair.common += std::min(of_i * static_cast<double>(image_of(map, k, a).keypoints.size()),
                            of_j * static_cast<double>(image_of(map, k, b).keypoints.size()));
    pair.matched += matched_in(map.keyframe(k).frame->bundled, a, b);
  }
  return pair;
}

bool explained_by(const PairEvidence& evidence) { return evidence.agreeing[0] >= kMinExplained * evidence.matches; }

// Change of the times of a camera by the refinement of the calibration.
TimeNs shift_of(const camera::Rig& given, const camera::Rig& final_rig, std::size_t camera) {
  return final_rig.camera(camera).time_offset_ns - given.camera(camera).time_offset_ns;
}

// Whether mirrored or rotated images, exchanged cameras or inverted transforms explain clearly more matches of a pair
// than its calibration before and after refinement.
bool is_mistaken(const PairEvidence& given, const PairEvidence& refined) {
  constexpr double kMuchMore = 0.15;  // share of matches
  if (!given.verdict || given.verdict == Convention::kAsGiven) return false;
  const int explained = given.with(*given.verdict);
  return explained >= kGoodShare * given.matches && explained >= refined.agreeing[0] + kMuchMore * given.matches &&
         (given.verdict == Convention::kMirrored || explained >= kClearly * given.agreeing[0]);
}

// Whether the refinement has changed the length of the baseline of a pair by far more than calibrations are wrong. The
// scale, which is that of the given lengths, is then wrong as well.
bool has_other_length(const camera::Rig& given, const camera::Rig& refined, std::size_t i, std::size_t j) {
  constexpr double kLonger = 1.4;
  const auto length = [&](const camera::Rig& rig) {
    return (rig.rig_from_cam(j).translation() - rig.rig_from_cam(i).translation()).norm();
  };
  const double before = length(given), after = length(refined);
  return after > kLonger * before || before > kLonger * after;
}

}  // namespace

bool CameraPair::hardly_matched() const {
  return overlap >= kMuchOverlap && keyframes >= kMinKeyframes && matched_share() < kHardlyAny;
}

std::string describe_hardly_matched(const CameraPair& pair, const std::string& first, const std::string& second) {
  return fmt::format(
      "the calibrated views of cameras {} and {} overlap by {:.0f} %, but only {:.1f} % of the features there are "
      "matched between them, and it cannot be told why: check which images are of which camera, their time stamps, "
      "and the extrinsics",
      first, second, 100 * pair.overlap, 100 * pair.matched_share());
}

bool shows_another_arrangement(const PairEvidence& evidence) {
  const bool mistaken = evidence.verdict && *evidence.verdict != Convention::kAsGiven;
  const bool elsewhere = evidence.other && evidence.other->is_another_arrangement();
  if (!mistaken && !elsewhere && !evidence.exchanged) return false;
  const int explained = evidence.exchanged ? evidence.exchanged->agreeing
                        : elsewhere        ? evidence.other->agreeing
                                           : evidence.agreeing[static_cast<std::size_t>(*evidence.verdict)];
  return explained >= kMinExplained * evidence.matches && explained >= kClearly * evidence.agreeing[0];
}

std::vector<CameraPair> test_pairs(const map::BundledMap& map, std::span<const KeyframeId> keyframes,
                                   std::size_t first_camera, const camera::Rig& given, const camera::Rig& final_rig,
                                   bool suspected) {
  std::vector<CameraPair> pairs;
  const std::vector<camera::SampledView> used = used_views(map, keyframes, first_camera, given);
  std::vector<std::vector<KeyframeId>> common;
  std::vector<std::uint8_t> sound(given.size(), 0);  // cameras with a pair that was matched
  for (std::size_t i = 0; i < given.size(); ++i) {
    for (std::size_t j = i + 1; j < given.size(); ++j) {
      common.push_back(common_keyframes(map, keyframes, first_camera + i, first_camera + j));
      pairs.push_back(count_features(map, common.back(), first_camera, given, used, i, j));
      if (pairs.back().overlap >= kMuchOverlap && pairs.back().matched_share() >= kEnough) sound[i] = sound[j] = 1;
    }
  }
  const std::size_t images =
      std::clamp<std::size_t>(kImagePairs / std::max<std::size_t>(pairs.size(), 1), 2, kImagesPerPair);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    CameraPair& pair = pairs[p];
    const std::size_t i = pair.first, j = pair.second;
    // The refinement may have estimated an offset between cameras that capture at the same time.
    const bool was_matched = common[p].empty() || (sound[i] && sound[j]);
    if (suspected && common[p].empty())
      common[p] = common_keyframes(map, keyframes, first_camera + i, first_camera + j,
                                   shift_of(given, final_rig, i) - shift_of(given, final_rig, j));
    if (common[p].empty() || (was_matched && !suspected)) continue;
    const Views views = spread_views(map, common[p], first_camera + i, first_camera + j, images);
    pair.evidence = judge_pair(given, i, j, views.first, views.second);
    const PairEvidence refined = judge_pair(final_rig, i, j, views.first, views.second);
    const bool mistaken = is_mistaken(*pair.evidence, refined);
    if (mistaken) pair.keyframes = static_cast<int>(common[p].size());
    const bool replaced = explained_by(refined) && !explained_by(*pair.evidence);
    pair.contradicted = mistaken || (replaced && has_other_length(given, final_rig, i, j)) ||
                        (shows_another_arrangement(*pair.evidence) && !explained_by(refined));
  }
  return pairs;
}

std::vector<CameraPair> disagreeing_pairs(const map::BundledMap& map, KeyframeId first, std::size_t first_camera,
                                          const camera::Rig& given, const camera::Rig& final_rig, bool suspected) {
  std::vector<KeyframeId> keyframes = map.keyframe_ids();
  std::erase_if(keyframes, [&](KeyframeId k) { return k < first; });
  std::vector<CameraPair> pairs = test_pairs(map, keyframes, first_camera, given, final_rig, suspected);
  std::erase_if(pairs, [](const CameraPair& pair) { return !pair.contradicted && !pair.hardly_matched(); });
  return pairs;
}

}  // namespace bslam::calibration
