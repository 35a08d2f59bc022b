// Writes and reads the BundledFrames of saved maps. What is read are arrays in the bytes of the file, if they can be
// used where they are.
#include <bit>
#include <cmath>
#include <utility>

#include "storage/map_sections.h"

namespace bslam::storage {
namespace {

using feature::Descriptor;
using feature::Keypoints;
using feature::Patch;
using frame::KeypointRef;

constexpr double kUnitTolerance = 1e-6;
constexpr double kMaxTwist = 1e6;             // rad/s, m/s
constexpr TimeNs kMaxTime = TimeNs{1} << 62;  // bounded so that differences do not overflow
constexpr std::size_t kPointNumbers = 3 + 9;  // numbers of a triangulated point and its covariance

// Arrays of these types are written and read as arrays of numbers.
static_assert(sizeof(Eigen::Vector2f) == 2 * sizeof(float) && sizeof(Eigen::Vector3d) == 3 * sizeof(double));
static_assert(sizeof(Descriptor) == 4 * sizeof(std::uint64_t) &&
              sizeof(Patch) == feature::kPatchSize * feature::kPatchSize);
static_assert(sizeof(WordId) == sizeof(std::int32_t) && sizeof(FeatureId) == sizeof(std::int32_t) &&
              sizeof(KeypointRef) == 2 * sizeof(std::int32_t));

const std::int32_t* numbers_of(const SharedArray<WordId>& ids) {
  return reinterpret_cast<const std::int32_t*>(ids.data());
}

void put_camera(const frame::CameraFrame& camera, bool with_words, ByteWriter& out) {
  const Keypoints& k = camera.keypoints;
  const std::size_t n = k.size();
  const bool has_words = with_words && camera.words.size() == n;
  out.number(static_cast<std::uint32_t>(camera.state));
  out.count(n);
  out.number(camera.time_ns);
  out.number(static_cast<std::uint32_t>(has_words));
  out.count(k.patch.patches().size());
  if (n == 0) return;
  out.array(k.pixel.data()->data(), 2 * n);
  out.array(k.level.data(), n);
  out.array(k.angle.data(), n);
  out.array(k.sigma.data(), n);
  out.array(k.bearing.data()->data(), 3 * n);
  out.array(k.descriptor.data()->data(), 4 * n);
  if (has_words) out.array(numbers_of(camera.words), n);
  if (!k.patch.complete()) out.array(k.patch.present().data(), k.patch.present().size());
  if (!k.patch.patches().empty()) out.array(k.patch.patches().data()->data(), k.patch.patches().size() * sizeof(Patch));
}

feature::Patches take_patches(SectionReader& in, std::size_t keypoints, std::size_t patches) {
  SharedArray<std::uint64_t> present;
  if (patches < keypoints) {
    present = in.array<std::uint64_t>((keypoints + 63) / 64);
    std::size_t bits = 0;
    for (const std::uint64_t word : present) bits += static_cast<std::size_t>(std::popcount(word));
    const bool beyond = in.ok() && keypoints % 64 != 0 && present.back() >> (keypoints % 64) != 0;
    in.require(!beyond && bits == patches, "marks of patches that do not agree with their number",
               "one mark per patch");
  }
  auto values = in.array<std::uint8_t, Patch>(patches);
  if (!in.ok()) return {};
  return {std::move(values), std::move(present), keypoints};
}

Keypoints take_keypoints(SectionReader& in, std::size_t n) {
  Keypoints k;
  k.pixel = in.array<float, Eigen::Vector2f>(n);
  k.level = in.array<std::uint8_t>(n);
  k.angle = in.array<float>(n);
  k.sigma = in.array<float>(n);
  k.bearing = in.array<double, Eigen::Vector3d>(n);
  k.descriptor = in.array<std::uint64_t, Descriptor>(n);
  return k;
}

void take_camera(SectionReader& in, const camera::Camera& calibration, int levels, bool with_words,
                 std::size_t& words_end, frame::CameraFrame& camera) {
  const auto state = in.number<std::uint32_t>();
  const std::size_t n = in.number<std::uint32_t>();
  camera.time_ns = in.number<TimeNs>();
  const auto has_words = in.number<std::uint32_t>();
  const std::size_t patches = in.number<std::uint32_t>();
  if (!check_image(in, state, camera) || !in.require(has_words <= 1, "an invalid flag", "0 or 1 (words follow)") ||
      !in.require(has_words == 0 || with_words, "words", "none, since the map has no vocabulary") ||
      !in.require(patches <= n, "more patches than keypoints", "at most one patch per keypoint") || n == 0) {
    return;
  }
  camera.keypoints = take_keypoints(in, n);
  if (!in.ok() || !check_keypoints(in, camera.keypoints, calibration, levels)) return;
  if (has_words == 1) camera.words = in.array<std::int32_t, WordId>(n);
  if (!check_words(in, camera.words, words_end)) return;
  camera.keypoints.patch = take_patches(in, n, patches);
  if (in.ok()) camera.grid = frame::FeatureGrid(camera.keypoints, calibration.width, calibration.height);
}

void put_bundled(const frame::Bundled& bundled, ByteWriter& out) {
  const frame::Bundled::Arrays& arrays = bundled.arrays();
  out.count(bundled.num_matched());
  out.count(bundled.size());
  out.number(static_cast<std::uint32_t>(bundled.has_points()));
  out.number(std::uint32_t{0});
  const std::uint32_t zero = 0;
  out.array(arrays.begin.empty() ? &zero : arrays.begin.data(), bundled.size() + 1);
  out.array(reinterpret_cast<const std::int32_t*>(arrays.refs.data()), 2 * arrays.refs.size());
  out.array(reinterpret_cast<const std::int32_t*>(arrays.feature.data()), arrays.feature.size());
  if (!bundled.has_points()) return;
  std::vector<std::uint8_t> flags;
  std::vector<double> numbers;
  for (std::size_t f = 0; f < bundled.num_matched(); ++f) {
    const auto& point = bundled.point(FeatureId(f));
    flags.push_back(static_cast<std::uint8_t>(point.has_value()));
    if (!point) continue;
    numbers.insert(numbers.end(), point->point_rig.data(), point->point_rig.data() + 3);
    numbers.insert(numbers.end(), point->covariance.data(), point->covariance.data() + 9);
  }
  out.array(flags.data(), flags.size());
  out.array(numbers.data(), numbers.size());
}

std::vector<std::optional<frame::BundledPoint>> take_points(SectionReader& in, std::size_t matched) {
  const SharedArray<std::uint8_t> flags = in.array<std::uint8_t>(matched);
  std::size_t count = 0;
  bool valid = true;
  for (const std::uint8_t flag : flags) {
    valid &= flag <= 1;
    count += flag;
  }
  in.require(valid, "an invalid flag", "0 or 1 (a point follows)");
  const SharedArray<double> numbers = in.array<double>(in.ok() ? kPointNumbers * count : 0);
  std::vector<std::optional<frame::BundledPoint>> points(in.ok() ? matched : 0);
  const double* at = numbers.data();
  for (std::size_t f = 0; f < points.size(); ++f) {
    if (flags[f] == 0) continue;
    const frame::BundledPoint point{Eigen::Vector3d(at), Eigen::Matrix3d(at + 3)};
    in.require(is_plausible(point.point_rig) && point.covariance.allFinite(), "an invalid point", "finite numbers");
    points[f] = point;
    at += kPointNumbers;
  }
  return points;
}

void take_bundled(SectionReader& in, frame::BundledFrame& frame) {
  std::vector<std::size_t> counts;
  std::size_t keypoints = 0;
  for (const frame::CameraFrame& c : frame.cameras) {
    counts.push_back(c.keypoints.size());
    keypoints += counts.back();
  }
  const std::size_t matched = in.number<std::uint32_t>(), features = in.number<std::uint32_t>();
  const auto has_points = in.number<std::uint32_t>(), unused = in.number<std::uint32_t>();
  if (!in.require(has_points <= 1 && unused == 0, "an invalid flag", "0 or 1 (points follow)") ||
      !in.require(matched <= features && features <= keypoints, "more features than keypoints",
                  "each keypoint in one feature")) {
    return;
  }
  frame::Bundled::Arrays arrays;
  arrays.begin = in.array<std::uint32_t>(features + 1);
  arrays.refs = in.array<std::int32_t, KeypointRef>(keypoints);
  arrays.feature = in.array<std::int32_t, FeatureId>(keypoints);
  std::vector<std::optional<frame::BundledPoint>> points;
  if (in.ok() && has_points == 1) points = take_points(in, matched);
  if (!in.ok()) return;
  auto bundled = frame::Bundled::from_arrays(counts, matched, std::move(arrays), points);
  if (in.require(bundled.has_value(), "a table of features that contradicts itself", "each keypoint in one feature"))
    frame.bundled = *std::move(bundled);
}

}  // namespace

bool check_image(SectionReader& in, std::uint32_t state, frame::CameraFrame& camera) {
  if (!in.require(state <= static_cast<std::uint32_t>(image::ImageState::kDamaged), "an unknown image state",
                  "present, missing or damaged"))
    return false;
  camera.state = static_cast<image::ImageState>(state);
  return in.require(std::abs(camera.time_ns / 2) < kMaxTime / 2, "a time out of range", "nanoseconds");
}

bool check_words(SectionReader& in, const SharedArray<WordId>& words, std::size_t& words_end) {
  for (const WordId word : words) {
    if (!in.require(word.valid(), "a negative word", "words of the vocabulary")) return false;
    words_end = std::max(words_end, word.index() + 1);
  }
  return in.ok();
}

// Pixels may be outside of the image, but not by more than its size.
bool check_keypoints(SectionReader& in, const Keypoints& k, const camera::Camera& camera, int levels) {
  const auto width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
  const auto within = [](float value, float size) { return value >= -size && value <= 2 * size; };  // false for NaN
  bool pixels = true, on_levels = true, numbers = true, unit = true;
  for (const Eigen::Vector2f& p : k.pixel) pixels &= within(p.x(), width) && within(p.y(), height);
  for (const std::uint8_t level : k.level) on_levels &= level < levels;
  for (std::size_t i = 0; i < k.size(); ++i)
    numbers &= std::isfinite(k.angle[i]) && std::isfinite(k.sigma[i]) && k.sigma[i] > 0;
  for (const Eigen::Vector3d& b : k.bearing) unit &= std::abs(b.squaredNorm() - 1) <= kUnitTolerance;
  return in.require(pixels, "a keypoint far outside of the image", "pixels of the camera") &&
         in.require(on_levels, "a keypoint on a level that does not exist", "levels of the pyramid") &&
         in.require(numbers, "an invalid angle or standard deviation",
                    "finite numbers and positive standard deviations") &&
         in.require(unit, "a bearing that is not a unit vector", "unit vectors");
}

void put_frame(const frame::BundledFrame& frame, const geometry::Vector6d& twist, bool with_words, ByteWriter& out) {
  out.number(frame.id.value());
  out.number(frame.time_ns);
  out.numbers(twist.data(), 6);
  for (const frame::CameraFrame& c : frame.cameras) put_camera(c, with_words, out);
  put_bundled(frame.bundled, out);
}

frame::BundledFrame take_frame_of(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                                  bool with_words, std::size_t& words_end, TakeCamera& take_camera,
                                  TakeBundled& take_bundled) {
  frame::BundledFrame frame;
  frame.id = FrameId(in.number<std::int32_t>());
  frame.time_ns = in.number<TimeNs>();
  in.numbers(frame.twist.data(), 6);
  if (!in.require(std::abs(frame.time_ns / 2) < kMaxTime / 2, "a time out of range", "nanoseconds") ||
      !in.require(frame.twist.allFinite() && frame.twist.cwiseAbs().maxCoeff() < kMaxTwist, "an invalid twist",
                  "finite numbers in rad/s and m/s")) {
    return frame;
  }
  frame.cameras.resize(rig.size());
  for (std::size_t c = 0; c < rig.size() && in.ok(); ++c) {
    in.enter("camera", c);
    take_camera(in, rig.camera(c), pyramid.levels, with_words, words_end, frame.cameras[c]);
    in.leave();
  }
  if (in.ok()) take_bundled(in, frame);
  return frame;
}

frame::BundledFrame take_frame(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                               bool with_words, std::size_t& words_end) {
  return take_frame_of(in, rig, pyramid, with_words, words_end, take_camera, take_bundled);
}

}  // namespace bslam::storage
