// Writes and reads the sections of keyframes and landmarks of saved maps.
#include <algorithm>
#include <numeric>
#include <type_traits>
#include <utility>

#include "storage/map_sections.h"

namespace bslam::storage {
namespace {

constexpr std::size_t kHeadBytes = 2 * sizeof(std::uint32_t);                        // number of keyframes, unused
constexpr std::size_t kKeyframeBytes = kTransformBytes + 2 * 4 + 8 + 6 * 8 + 2 * 8;  // minimum, without cameras
constexpr std::size_t kKeyframesPerTask = 16;

// Writes a property of each of these landmarks as one array.
template <class Of>
void put_property(std::span<const LandmarkId> landmarks, const Of& of, ByteWriter& out) {
  using Value = std::invoke_result_t<Of, LandmarkId>;
  std::vector<Value> values;
  values.reserve(landmarks.size());
  for (const LandmarkId l : landmarks) values.push_back(of(l));
  if constexpr (std::is_arithmetic_v<Value>) {
    out.array(values.data(), values.size());
  } else {
    const auto* const first = values.empty() ? nullptr : values.front().data();
    out.array(first, values.empty() ? 0 : values.size() * static_cast<std::size_t>(values.front().size()));
  }
}

// Where each keyframe begins in the section, and where the last one ends.
SharedArray<std::uint64_t> take_places(SectionReader& in, std::size_t keyframes) {
  auto places = in.array<std::uint64_t>(keyframes + 1);
  if (!in.ok()) return {};
  bool valid = places.front() == kHeadBytes + (keyframes + 1) * sizeof(std::uint64_t) && places.back() == in.size();
  for (std::size_t i = 0; i < keyframes; ++i) {
    valid &=
        places[i] <= places[i + 1] && places[i + 1] - places[i] >= kKeyframeBytes && places[i + 1] % kAlignment == 0;
  }
  in.require(valid, "keyframes at impossible places", "keyframes that follow each other");
  return places;
}

struct Keyframe {
  std::shared_ptr<const frame::BundledFrame> frame;
  geometry::SE3 T_rig_world;
  KeyframeId parent;
  std::size_t words_end = 0;
  std::optional<Error> error = {};
};

Keyframe take_keyframe(SectionReader in, std::size_t i, std::size_t keyframes, bool with_words,
                       const map::BundledMap& map) {
  Keyframe out;
  in.enter("keyframe", i);
  out.T_rig_world = take_transform(in);
  out.parent = take_parent(in, keyframes);
  auto frame = take_frame(in, map.rig(), map.pyramid(), with_words, out.words_end);
  if (in.ok()) in.finish();
  if (!in.ok()) out.error = in.error();
  out.frame = std::make_shared<const frame::BundledFrame>(std::move(frame));
  return out;
}

}  // namespace

KeyframeId take_parent(SectionReader& in, std::size_t keyframes) {
  const auto parent = in.number<std::int32_t>();
  in.require(parent >= -1 && (parent < 0 || static_cast<std::size_t>(parent) < keyframes),
             "a parent that does not exist", "a keyframe, or -1");
  return KeyframeId(parent);
}

void put_keyframes(const map::BundledMap& map, const FileIds& ids, bool with_words, ByteWriter& out) {
  out.count(map.num_keyframes());
  out.number(std::uint32_t{0});
  std::size_t entry = out.size();
  for (std::size_t i = 0; i <= map.num_keyframes(); ++i) out.number(std::uint64_t{0});
  const auto begin_keyframe = [&] {
    out.align();
    out.replace(entry, std::uint64_t{out.size()});
    entry += sizeof(std::uint64_t);
  };
  for (const KeyframeId k : map.keyframe_ids()) {
    begin_keyframe();
    const map::BundledKeyframe& keyframe = map.keyframe(k);
    put_transform(keyframe.T_rig_world, out);
    out.number(keyframe.parent.valid() ? ids.keyframe[keyframe.parent.index()].value() : -1);
    put_frame(*keyframe.frame, keyframe.twist, with_words, out);
  }
  begin_keyframe();
}

KeyframeSection take_keyframes(SectionReader& in, bool with_words, const map::BundledMap& map, ThreadPool& pool) {
  KeyframeSection section;
  const std::size_t n = in.count(kKeyframeBytes + sizeof(std::uint64_t));
  in.require(in.number<std::uint32_t>() == 0, "an invalid number", "0");
  const SharedArray<std::uint64_t> places = take_places(in, n);
  if (!in.ok()) return section;
  std::vector<Keyframe> keyframes(n);
  pool.for_each((n + kKeyframesPerTask - 1) / kKeyframesPerTask, [&](std::size_t task) {
    for (std::size_t i = task * kKeyframesPerTask; i < std::min(n, (task + 1) * kKeyframesPerTask); ++i)
      keyframes[i] = take_keyframe(in.part(places[i], places[i + 1]), i, n, with_words, map);
  });
  for (Keyframe& k : keyframes) {
    if (k.error) {
      in.refuse(*std::move(k.error));
      return {};
    }
    section.frames.push_back(std::move(k.frame));
    section.T_rig_world.push_back(k.T_rig_world);
    section.parents.push_back(k.parent);
    section.words_end = std::max(section.words_end, k.words_end);
  }
  return section;
}

void put_landmarks(const map::BundledMap& map, const FileIds& ids, ByteWriter& out) {
  const std::vector<LandmarkId> landmarks = map.landmark_ids();
  const auto keyframe = [&](KeyframeId k) { return ids.keyframe[k.index()].value(); };
  const auto put = [&](const auto& property) { put_property(landmarks, property, out); };
  const auto of = [&](LandmarkId l) -> const map::Landmark& { return map.landmark(l); };
  std::vector<std::int32_t> observing, features;
  std::vector<std::uint8_t> aligned;
  for (const LandmarkId l : landmarks) {
    for (const map::Observation& o : map.observations(l)) {
      observing.push_back(keyframe(o.keyframe));
      features.push_back(o.feature.value());
      aligned.push_back(static_cast<std::uint8_t>(o.aligned));
    }
  }
  out.count(landmarks.size());
  out.count(observing.size());
  put([&](LandmarkId l) { return of(l).position; });
  put([&](LandmarkId l) { return of(l).view_direction; });
  put([&](LandmarkId l) { return of(l).descriptor; });
  put([&](LandmarkId l) { return Eigen::Vector2f(of(l).min_distance, of(l).max_distance); });
  put([&](LandmarkId l) { return keyframe(of(l).reference.keyframe); });
  put([&](LandmarkId l) { return ids.nearest_older(of(l).born).value(); });
  put([&](LandmarkId l) {
    const frame::KeypointRef r = of(l).reference.keypoint;
    return std::array{r.camera.value(), r.keypoint.value()};
  });
  put([&](LandmarkId l) { return of(l).expected; });
  put([&](LandmarkId l) { return of(l).found; });
  put([&](LandmarkId l) { return static_cast<std::uint32_t>(map.observations(l).size()); });
  out.array(observing.data(), observing.size());
  out.array(features.data(), features.size());
  out.array(aligned.data(), aligned.size());
}

LandmarkSection take_landmarks(SectionReader& in) {
  LandmarkSection s;
  const std::size_t n = in.number<std::uint32_t>(), observations = in.number<std::uint32_t>();
  s.position = in.array<double, Eigen::Vector3d>(n);
  s.view_direction = in.array<double, Eigen::Vector3d>(n);
  s.descriptor = in.array<std::uint64_t, feature::Descriptor>(n);
  s.distances = in.array<float, Eigen::Vector2f>(n);
  s.reference = in.array<std::int32_t, KeyframeId>(n);
  s.born = in.array<std::int32_t, KeyframeId>(n);
  s.keypoint = in.array<std::int32_t, frame::KeypointRef>(n);
  s.expected = in.array<std::uint32_t>(n);
  s.found = in.array<std::uint32_t>(n);
  s.counts = in.array<std::uint32_t>(n);
  s.observing = in.array<std::int32_t, KeyframeId>(observations);
  s.features = in.array<std::int32_t, FeatureId>(observations);
  s.aligned = in.array<std::uint8_t>(observations);
  if (!in.finish()) return {};
  const auto finite = [](const Eigen::Vector3d& v) { return (v.array().abs() <= 2).all(); };
  const auto lengths = [](const Eigen::Vector2f& v) { return v.allFinite() && v.x() >= 0 && v.y() >= 0; };
  in.require(std::ranges::all_of(s.position, is_plausible), "an invalid position", "finite coordinates");
  in.require(std::ranges::all_of(s.view_direction, finite), "an invalid viewing direction", "unit vectors");
  in.require(std::ranges::all_of(s.distances, lengths), "an invalid distance", "finite numbers");
  in.require(std::accumulate(s.counts.begin(), s.counts.end(), std::uint64_t{0}) == observations,
             "numbers of observations that do not add up", "their total number");
  return s;
}

map::Landmark LandmarkSection::landmark(std::size_t i) const {
  map::Landmark out;
  out.position = position[i];
  out.reference = {reference[i], keypoint[i]};
  out.born = born[i];
  out.expected = expected[i];
  out.found = found[i];
  if (view_direction.empty()) return out;
  out.view_direction = view_direction[i];
  out.descriptor = descriptor[i];
  out.min_distance = distances[i].x();
  out.max_distance = distances[i].y();
  return out;
}

}  // namespace bslam::storage
