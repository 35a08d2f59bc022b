// Reads the BundledFrames of saved maps of versions 2 to 4.
#include <utility>

#include "storage/map_sections.h"

namespace bslam::storage {
namespace {

using feature::Descriptor;
using feature::Keypoints;
using feature::Patch;
using frame::KeypointRef;

// Pixel, level, angle, sigma, bearing, descriptor and patch of one keypoint. The bearing is stored, since it was
// computed before the pixel was rounded to float and cannot be recomputed exactly.
constexpr std::size_t kKeypointBytes = 8 + 1 + 4 + 4 + 24 + 32 + sizeof(Patch);
constexpr std::size_t kMatchedBytes = 1 + 2 * (2 + 4) + 1;  // minimum

Keypoints take_keypoints(SectionReader& in) {
  const std::size_t n = in.count(kKeypointBytes);
  if (n == 0) return {};
  feature::Detections k;
  k.pixel.resize(n);
  k.level.resize(n);
  k.angle.resize(n);
  k.sigma.resize(n);
  k.bearing.resize(n);
  k.descriptor.resize(n);
  k.patch.resize(n);
  in.numbers(k.pixel.data()->data(), 2 * n);
  in.numbers(k.level.data(), n);
  in.numbers(k.angle.data(), n);
  in.numbers(k.sigma.data(), n);
  in.numbers(k.bearing.data()->data(), 3 * n);
  in.numbers(k.descriptor.data()->data(), 4 * n);
  in.numbers(k.patch.data()->data(), n * sizeof(Patch));
  return k;
}

void take_words(SectionReader& in, frame::CameraFrame& camera, bool with_words, std::size_t& words_end) {
  const auto has_words = in.number<std::uint8_t>();
  if (!in.require(has_words <= 1, "an invalid flag", "0 or 1 (words follow)")) return;
  if (has_words == 0 || !in.require(with_words, "words", "none, since the map has no vocabulary")) return;
  const std::size_t n = camera.keypoints.size();
  if (!in.require(n <= in.remaining() / sizeof(std::int32_t), "the end of the section", "one word per keypoint"))
    return;
  std::vector<WordId> words;
  words.reserve(n);
  for (std::size_t i = 0; i < n; ++i) words.emplace_back(in.number<std::int32_t>());
  camera.words = std::move(words);
  check_words(in, camera.words, words_end);
}

void take_camera(SectionReader& in, const camera::Camera& calibration, int levels, bool with_words,
                 std::size_t& words_end, frame::CameraFrame& camera) {
  const auto state = in.number<std::uint8_t>();
  camera.time_ns = in.number<TimeNs>();
  if (!check_image(in, state, camera)) return;
  camera.keypoints = take_keypoints(in);
  if (!in.ok() || !check_keypoints(in, camera.keypoints, calibration, levels)) return;
  take_words(in, camera, with_words, words_end);
  if (!in.ok() || camera.keypoints.empty()) return;
  camera.grid = frame::FeatureGrid(camera.keypoints, calibration.width, calibration.height);
}

// Reads one matched feature. `taken` has a flag for every keypoint of every camera, set when a feature uses it.
std::vector<KeypointRef> take_group(SectionReader& in, const frame::BundledFrame& frame,
                                    std::vector<std::vector<std::uint8_t>>& taken) {
  const std::size_t size = in.number<std::uint8_t>();
  std::vector<KeypointRef> group;
  if (!in.require(size >= 2 && size <= frame.cameras.size(), "a matched feature with too few or too many keypoints",
                  "two or more keypoints, at most one per camera")) {
    return group;
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t c = in.number<std::uint16_t>(), k = in.number<std::uint32_t>();
    if (!in.require(c < frame.cameras.size() && k < frame.cameras[c].keypoints.size(), "a keypoint that does not exist",
                    "a keypoint of the frame") ||
        !in.require(group.empty() || group.back().camera.index() < c, "cameras out of order or repeated",
                    "one keypoint per camera") ||
        !in.require(!std::exchange(taken[c][k], std::uint8_t{1}), "a keypoint of two features",
                    "one feature per keypoint")) {
      break;
    }
    group.push_back({CameraIndex(c), KeypointIndex(k)});
  }
  return group;
}

std::optional<frame::BundledPoint> take_point(SectionReader& in) {
  const auto has_point = in.number<std::uint8_t>();
  if (!in.require(has_point <= 1, "an invalid flag", "0 or 1 (a point follows)") || has_point == 0) return {};
  frame::BundledPoint point;
  in.numbers(point.point_rig.data(), 3);
  in.numbers(point.covariance.data(), 9);
  in.require(is_plausible(point.point_rig) && point.covariance.allFinite(), "an invalid point", "finite numbers");
  return point;
}

void take_bundled(SectionReader& in, frame::BundledFrame& frame) {
  std::vector<std::size_t> counts;
  std::vector<std::vector<std::uint8_t>> taken;
  for (const frame::CameraFrame& c : frame.cameras) {
    counts.push_back(c.keypoints.size());
    taken.emplace_back(c.keypoints.size(), std::uint8_t{0});
  }
  const std::size_t matched = in.count(kMatchedBytes);
  std::vector<std::vector<KeypointRef>> groups;
  std::vector<std::optional<frame::BundledPoint>> points;
  groups.reserve(matched);
  points.reserve(matched);
  for (std::size_t f = 0; f < matched && in.ok(); ++f) {
    in.enter("feature", f);
    groups.push_back(take_group(in, frame, taken));
    points.push_back(take_point(in));
    in.leave();
  }
  if (in.ok()) frame.bundled = frame::Bundled(counts, groups, points);
}

}  // namespace

frame::BundledFrame take_frame_4(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                                 bool with_words, std::size_t& words_end) {
  return take_frame_of(in, rig, pyramid, with_words, words_end, take_camera, take_bundled);
}

}  // namespace bslam::storage
