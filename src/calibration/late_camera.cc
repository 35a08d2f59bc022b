#include "calibration/late_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <utility>

#include "calibration/camera_views.h"
#include "calibration/convention_check.h"

namespace bslam::calibration {
namespace {

constexpr std::size_t kTriple = 3;  // number of consecutive frames

// The triples from `begin` to `end`.
struct Part {
  std::string_view name;
  std::size_t begin, end;
};

// Returns true if the images of each frame were taken within a quarter of the interval between frames. Images of
// cameras that are triggered one after the other may be nearer to those of the next frame.
bool are_together(std::span<const image::ImageBundle> triple) {
  const TimeNs interval_ns = (triple[2].time_ns - triple[0].time_ns) / 2;
  return std::ranges::all_of(triple, [&](const image::ImageBundle& frame) {
    return std::ranges::all_of(frame.images, [&](const image::CameraImage& image) {
      return image.state != image::ImageState::kPresent || 4 * std::abs(image.time_ns - frame.time_ns) <= interval_ns;
    });
  });
}

// The keypoints by camera and frame of the triples whose images were taken together. Single images may have wrong time
// stamps.
std::vector<std::vector<View>> views_taken_together(const camera::Rig& rig, std::span<const image::ImageBundle> triples,
                                                    std::span<const image::Image> masks) {
  std::vector<std::vector<View>> out(rig.size());
  for (std::size_t first = 0; first < triples.size(); first += kTriple) {
    const auto triple = triples.subspan(first, kTriple);
    if (!are_together(triple)) continue;
    std::vector<std::vector<View>> views = extract_views(rig, triple, masks);
    for (std::size_t c = 0; c < rig.size(); ++c) std::ranges::move(views[c], std::back_inserter(out[c]));
  }
  return out;
}

// Matches of images of frame 1 of the first camera and of frame `of_second` of the second one.
PairEvidence compare(const camera::Rig& rig, std::size_t i, std::size_t j, const std::vector<std::vector<View>>& views,
                     const Part& part, std::size_t of_second) {
  std::vector<feature::Detections> of_i, of_j;
  for (std::size_t t = part.begin; t < part.end; ++t) {
    of_i.push_back(views[i][kTriple * t + 1].keypoints);
    of_j.push_back(views[j][kTriple * t + of_second].keypoints);
  }
  return judge_pair(rig, i, j, of_i, of_j);
}

constexpr int kMinAgreeing = 60;  // matches

double share(const PairEvidence& e) { return e.matches > 0 ? 1.0 * e.agreeing[0] / e.matches : 0.0; }

// The calibration as given, and as estimated from the images of the run; without an estimate, the same one.
struct Calibrations {
  const camera::Rig &given, &estimated;
};

// Returns the shift of the second camera of the pair; nullopt if images of the same frame fit as well, with the given
// or the estimated calibration. With a wrong rotation, images that are one frame apart may fit better while the rig
// turns steadily.
std::optional<LateCamera> judge(const Calibrations& calibrations, std::size_t i, std::size_t j,
                                const std::vector<std::vector<View>>& views, const Part& part) {
  constexpr double kClearly = 1.3, kMuchLarger = 0.15;
  const camera::Rig& rig = calibrations.given;
  const PairEvidence same = compare(rig, i, j, views, part, 1);
  if (same.matches < kMinAgreeing) return std::nullopt;
  std::optional<LateCamera> out;
  for (const std::size_t frame : {0u, 2u}) {
    const PairEvidence apart = compare(rig, i, j, views, part, frame);
    if (apart.agreeing[0] < kMinAgreeing || apart.matches > 2 * same.matches ||
        share(apart) < std::max(kGoodShare, share(same) + kMuchLarger) ||
        apart.agreeing[0] < kClearly * same.agreeing[0] || (out && apart.agreeing[0] < out->agreeing_apart))
      continue;
    out = LateCamera{.camera = j,
                     .reference = i,
                     .early = frame == 0,
                     .matches = same.matches,
                     .agreeing = same.agreeing[0],
                     .matches_apart = apart.matches,
                     .agreeing_apart = apart.agreeing[0]};
  }
  if (!out || &calibrations.estimated == &rig) return out;
  const PairEvidence estimated = compare(calibrations.estimated, i, j, views, part, 1);
  return estimated.agreeing[0] < out->agreeing_apart ? out : std::nullopt;
}

// Returns true if images of the same frame fit outside of the part, as expected if the camera lost a frame, or caught
// up, at the border of the part. A wrong rotation also looks like a late image while the rig turns steadily, but then
// images of the same frame fit nowhere.
bool fits_elsewhere(const camera::Rig& rig, const LateCamera& late, const std::vector<std::vector<View>>& views,
                    const Part& part) {
  const std::size_t count = views[late.camera].size() / kTriple;
  const Part rest = part.begin == 0 ? Part{"", part.end, count} : Part{"", 0, part.begin};
  const PairEvidence same =
      compare(rig, std::min(late.camera, late.reference), std::max(late.camera, late.reference), views, rest, 1);
  return same.agreeing[0] >= kMinAgreeing && share(same) >= kGoodShare;
}

// The camera that most pairs show to be late in a part of the triples.
std::optional<LateCamera> find_in_part(const Calibrations& calibrations, const std::vector<std::vector<View>>& views,
                                       const Part& part) {
  const camera::Rig& rig = calibrations.given;
  std::vector<LateCamera> found;
  std::vector<int> votes(rig.size(), 0);
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      if (std::max(rig.overlap_share(i, j), rig.overlap_share(j, i)) < kSomeOverlap) continue;
      const auto late = judge(calibrations, i, j, views, part);
      if (!late) continue;
      found.push_back(*late);
      ++votes[i];
      ++votes[j];
    }
  }
  if (found.empty()) return std::nullopt;
  const auto most = std::ranges::max_element(found, {}, [&](const LateCamera& late) {
    return std::pair(std::max(votes[late.camera], votes[late.reference]), late.agreeing_apart);
  });
  LateCamera out = *most;
  if (votes[out.reference] > votes[out.camera]) {
    std::swap(out.camera, out.reference);
    out.early = !out.early;
  }
  out.part = part.name;
  return out;
}

}  // namespace

std::optional<LateCamera> find_late_camera(const camera::Rig& rig, const camera::Rig& estimated,
                                           std::span<const image::ImageBundle> triples,
                                           std::span<const image::Image> masks) {
  const std::vector<std::vector<View>> views = views_taken_together(rig, triples, masks);
  const std::size_t count = views.front().size() / kTriple;
  // Cameras that are not triggered together are not compared.
  if (2 * count < triples.size() / kTriple) return std::nullopt;
  const std::array<Part, 5> parts = {{{"", 0, count},
                                      {"first half", 0, count / 2},
                                      {"last half", count - count / 2, count},
                                      {"first quarter", 0, count / 4},
                                      {"last quarter", count - count / 4, count}}};
  for (const Part& part : parts) {
    auto found = find_in_part({rig, estimated}, views, part);
    if (found && (part.name.empty() || fits_elsewhere(rig, *found, views, part))) return found;
  }
  return std::nullopt;
}

std::string describe_late_camera(const LateCamera& late, const std::string& camera, const std::string& reference) {
  return fmt::format(
      "{}: its images are about one frame {} compared with {}{}: {} of {} matches of images that are one frame apart "
      "are consistent with the calibration, and {} of {} of the same frame: check the numbers or time stamps of its "
      "images",
      camera, late.early ? "early" : "late", reference,
      late.part.empty() ? "" : fmt::format(" in the {} of the recording", late.part), late.agreeing_apart,
      late.matches_apart, late.agreeing, late.matches);
}

}  // namespace bslam::calibration
