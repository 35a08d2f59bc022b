// Strong identifiers: distinct, ordered types that cannot be mixed up. An id is never reused within a run.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace bslam {

template <class Tag>
class Id {
 public:
  constexpr Id() = default;
  constexpr explicit Id(std::int32_t value) : value_(value) {}
  constexpr explicit Id(std::size_t value) : value_(static_cast<std::int32_t>(value)) {}

  constexpr std::int32_t value() const { return value_; }
  constexpr std::size_t index() const { return static_cast<std::size_t>(value_); }
  constexpr bool valid() const { return value_ >= 0; }
  constexpr Id next() const { return Id(value_ + 1); }

  friend constexpr auto operator<=>(Id, Id) = default;

 private:
  std::int32_t value_ = -1;  // -1: invalid
};

using CameraIndex = Id<struct CameraTag>;      // index of a camera in the rig
using KeypointIndex = Id<struct KeypointTag>;  // index into the Keypoints of one camera
using FeatureId = Id<struct FeatureTag>;       // unique feature within one BundledFrame
using FrameId = Id<struct FrameTag>;           // input frame, in order of time
using KeyframeId = Id<struct KeyframeTag>;     // assigned by MapStore at commit
using LandmarkId = Id<struct LandmarkTag>;     // assigned by MapStore at commit
using WordId = Id<struct WordTag>;             // word of the place-recognition vocabulary
using MapVersion = Id<struct MapVersionTag>;   // incremented by every commit

}  // namespace bslam

template <class Tag>
struct std::hash<bslam::Id<Tag>> {
  std::size_t operator()(bslam::Id<Tag> id) const noexcept { return std::hash<std::int32_t>{}(id.value()); }
};
