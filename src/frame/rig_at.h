// The rig with the extrinsics at the time of a frame; frame::rig_of adds the motion during the capture.
#pragma once

#include <optional>

#include "frame/bundled_frame.h"

namespace bslam::frame {

// Without moves of cameras it is the given rig, which must outlive it and is not copied.
class RigAt {
 public:
  RigAt(const camera::Rig& rig, const BundledFrame& frame) : rig_(rig) {
    if (!rig.moves().empty()) moved_ = rig.at(frame.time_ns);
  }
  RigAt(const RigAt&) = delete;
  RigAt& operator=(const RigAt&) = delete;

  const camera::Rig& operator*() const { return moved_ ? *moved_ : rig_; }

 private:
  const camera::Rig& rig_;
  std::optional<camera::Rig> moved_;
};

}  // namespace bslam::frame
