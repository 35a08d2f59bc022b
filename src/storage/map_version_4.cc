// Reads the sections of keyframes and landmarks of saved maps of versions 2 to 4.
#include <utility>

#include "storage/map_sections.h"

namespace bslam::storage {
namespace {

constexpr std::size_t kObservationBytes = 4 + 4 + 1;
constexpr std::size_t kLandmarkBytes = 3 * 8 + 4 + 2 + 4 + 3 * 4 + 4 + kObservationBytes;

}  // namespace

KeyframeSection take_keyframes_4(SectionReader& in, bool with_words, const map::BundledMap& map) {
  constexpr std::size_t kKeyframeBytes = kTransformBytes + 4 + 4 + 8 + 4;
  constexpr std::size_t kCameraFrameBytes = 1 + 8 + 4 + 1;
  const std::size_t n = in.count(kKeyframeBytes + map.rig().size() * kCameraFrameBytes);
  KeyframeSection section;
  for (std::size_t i = 0; i < n && in.ok(); ++i) {
    in.enter("keyframe", i);
    section.T_rig_world.push_back(take_transform(in));
    section.parents.push_back(take_parent(in, n));
    section.frames.push_back(std::make_shared<const frame::BundledFrame>(
        take_frame_4(in, map.rig(), map.pyramid(), with_words, section.words_end)));
    in.leave();
  }
  in.finish();
  return section;
}

LandmarkSection take_landmarks_4(SectionReader& in) {
  const std::size_t n = in.count(kLandmarkBytes);
  std::vector<Eigen::Vector3d> position;
  std::vector<KeyframeId> reference, born, observing;
  std::vector<frame::KeypointRef> keypoint;
  std::vector<std::uint32_t> expected, found, counts;
  std::vector<FeatureId> features;
  std::vector<std::uint8_t> aligned;
  for (std::size_t i = 0; i < n && in.ok(); ++i) {
    in.enter("landmark", i);
    in.numbers(position.emplace_back().data(), 3);
    in.require(is_plausible(position.back()), "an invalid position", "finite coordinates");
    reference.emplace_back(in.number<std::int32_t>());
    const CameraIndex camera(std::size_t{in.number<std::uint16_t>()});
    keypoint.push_back({camera, KeypointIndex(in.number<std::int32_t>())});
    born.emplace_back(in.number<std::int32_t>());
    expected.push_back(in.number<std::uint32_t>());
    found.push_back(in.number<std::uint32_t>());
    counts.push_back(static_cast<std::uint32_t>(in.count(kObservationBytes)));
    for (std::uint32_t o = 0; o < counts.back(); ++o) {
      observing.emplace_back(in.number<std::int32_t>());
      features.emplace_back(in.number<std::int32_t>());
      aligned.push_back(in.number<std::uint8_t>());
    }
    in.leave();
  }
  if (!in.finish()) return {};
  LandmarkSection s;
  s.position = std::move(position);
  s.reference = std::move(reference);
  s.born = std::move(born);
  s.keypoint = std::move(keypoint);
  s.expected = std::move(expected);
  s.found = std::move(found);
  s.counts = std::move(counts);
  s.observing = std::move(observing);
  s.features = std::move(features);
  s.aligned = std::move(aligned);
  return s;
}

}  // namespace bslam::storage
