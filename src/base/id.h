// Strong identifiers: distinct types that do not mix, ordered, never recycled within a run.
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
  std::int32_t value_ = -1;  // -1: no such thing
};

using CameraIndex = Id<struct CameraTag>;      // position of a camera in the rig of the run
using KeypointIndex = Id<struct KeypointTag>;  // position in the Keypoints of one camera
using FeatureId = Id<struct FeatureTag>;       // unique feature within one BundledFrame
using FrameId = Id<struct FrameTag>;           // input frame, in order of time
using KeyframeId = Id<struct KeyframeTag>;     // given by MapStore at commit
using LandmarkId = Id<struct LandmarkTag>;     // given by MapStore at commit
using WordId = Id<struct WordTag>;             // word of the place-recognition vocabulary
using MapVersion = Id<struct MapVersionTag>;   // one more with every commit

}  // namespace bslam

template <class Tag>
struct std::hash<bslam::Id<Tag>> {
  std::size_t operator()(bslam::Id<Tag> id) const noexcept { return std::hash<std::int32_t>{}(id.value()); }
};
