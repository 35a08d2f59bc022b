// Writes maps as files of version 4, which this program reads but does not write any more.
#pragma once

#include <string>

#include "storage/map_checksum.h"
#include "storage/map_sections.h"

namespace bslam::storage {

inline void put_camera_4(const frame::CameraFrame& camera, bool with_words, ByteWriter& out) {
  const feature::Keypoints& k = camera.keypoints;
  const std::size_t n = k.size();
  out.number(static_cast<std::uint8_t>(camera.state));
  out.number(camera.time_ns);
  out.count(n);
  if (n > 0) {
    out.numbers(k.pixel.data()->data(), 2 * n);
    out.numbers(k.level.data(), n);
    out.numbers(k.angle.data(), n);
    out.numbers(k.sigma.data(), n);
    out.numbers(k.bearing.data()->data(), 3 * n);
    out.numbers(k.descriptor.data()->data(), 4 * n);
    out.numbers(k.patch.patches().data()->data(), n * sizeof(feature::Patch));
  }
  const bool has_words = with_words && camera.words.size() == n;
  out.number(static_cast<std::uint8_t>(has_words));
  for (std::size_t i = 0; has_words && i < n; ++i) out.number(camera.words[i].value());
}

inline void put_bundled_4(const frame::Bundled& bundled, ByteWriter& out) {
  out.count(bundled.num_matched());
  for (std::size_t f = 0; f < bundled.num_matched(); ++f) {
    const auto refs = bundled.keypoints(FeatureId(f));
    out.number(static_cast<std::uint8_t>(refs.size()));
    for (const frame::KeypointRef r : refs) {
      out.number(static_cast<std::uint16_t>(r.camera.value()));
      out.number(static_cast<std::uint32_t>(r.keypoint.value()));
    }
    const auto& point = bundled.point(FeatureId(f));
    out.number(static_cast<std::uint8_t>(point.has_value()));
    if (!point) continue;
    out.numbers(point->point_rig.data(), 3);
    out.numbers(point->covariance.data(), 9);
  }
}

inline void put_keyframes_4(const map::BundledMap& map, const FileIds& ids, bool with_words, ByteWriter& out) {
  out.count(map.num_keyframes());
  for (const KeyframeId k : map.keyframe_ids()) {
    const map::BundledKeyframe& keyframe = map.keyframe(k);
    put_transform(keyframe.T_rig_world, out);
    out.number(keyframe.parent.valid() ? ids.keyframe[keyframe.parent.index()].value() : -1);
    out.number(keyframe.frame->id.value());
    out.number(keyframe.frame->time_ns);
    out.numbers(keyframe.twist.data(), 6);
    for (const frame::CameraFrame& c : keyframe.frame->cameras) put_camera_4(c, with_words, out);
    put_bundled_4(keyframe.frame->bundled, out);
  }
}

inline void put_landmarks_4(const map::BundledMap& map, const FileIds& ids, ByteWriter& out) {
  out.count(map.num_landmarks());
  for (const LandmarkId l : map.landmark_ids()) {
    const map::Landmark& landmark = map.landmark(l);
    out.numbers(landmark.position.data(), 3);
    out.number(ids.keyframe[landmark.reference.keyframe.index()].value());
    out.number(static_cast<std::uint16_t>(landmark.reference.keypoint.camera.value()));
    out.number(landmark.reference.keypoint.keypoint.value());
    out.number(ids.nearest_older(landmark.born).value());
    out.number(landmark.expected);
    out.number(landmark.found);
    out.count(map.observations(l).size());
    for (const map::Observation& o : map.observations(l)) {
      out.number(ids.keyframe[o.keyframe.index()].value());
      out.number(o.feature.value());
      out.number(static_cast<std::uint8_t>(o.aligned));
    }
  }
}

// The section of rigs of version 5, without moves of cameras. The given calibration must be that of the map.
inline std::string rigs_of_version_5(const map::BundledMap& map) {
  constexpr std::size_t kCount = sizeof(std::uint32_t);  // of cameras, and of moves
  ByteWriter out;
  put_rigs(map, out);
  const std::string bytes = std::move(out).take();
  const std::size_t one = (bytes.size() - kCount) / 2;
  return bytes.substr(0, kCount + one - kCount) + bytes.substr(kCount + one, one - kCount);
}

// `info` must have no warning: the text is absent then.
inline std::string version_4_bytes(const map::BundledMap& map, const MapFileInfo& info) {
  const FileIds ids(map);
  std::array<ByteWriter, 4> writers;
  const std::string rigs = rigs_of_version_5(map);
  writers[0].numbers(rigs.data(), rigs.size());
  put_info(map, info, writers[1]);
  put_keyframes_4(map, ids, info.vocabulary != 0, writers[2]);
  put_landmarks_4(map, ids, writers[3]);
  std::array<std::string, 4> sections;
  std::size_t total = 96;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    sections[i] = std::move(writers[i]).take();
    if (i == 1) sections[i].resize(sections[i].size() - sizeof(std::uint32_t));  // the length of the warning
    total += sections[i].size();
  }
  ByteWriter header;
  header.numbers("BSLAMMAP", 8);
  for (const std::uint32_t number : {0x01020304u, 4u, 4u}) header.number(number);
  header.number(std::uint64_t{total});
  constexpr std::array<const char*, 4> kTags = {"RIG ", "INFO", "KEYF", "LAND"};
  for (std::size_t i = 0; i < sections.size(); ++i) {
    header.numbers(kTags[i], 4);
    header.number(crc32_of(sections[i]));
    header.number(std::uint64_t{sections[i].size()});
  }
  std::string bytes = std::move(header).take();
  ByteWriter seal;
  seal.number(crc32_of(bytes));
  bytes += std::move(seal).take();
  for (const std::string& s : sections) bytes += s;
  return bytes;
}

}  // namespace bslam::storage
