// What the live view needs of every frame of a run, in a compact form: it grows for as long as the run lasts, whether a
// browser is connected or not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "map/anchored_pose.h"
#include "tracking/frame_record.h"

namespace bslam::live_view {

// An input frame of the run.
struct InputFrame {
  TimeNs time_ns = 0;
  const tracking::FrameRecord* record = nullptr;  // null if it was dropped
  double read_ms = 0;
  TimeNs relocalised_with_ns = 0;  // time of the keyframe, if the frame was relocalised
};

class FrameLog {
 public:
  // The frame that was relocalised, and the matched keyframe.
  struct Relocalised {
    TimeNs time_ns = 0, with_ns = 0;
    int inliers = 0;
  };
  struct Stage {
    std::string_view name;
    float ms = 0;
  };

  // Number of cameras of the run.
  explicit FrameLog(std::size_t cameras) : num_cameras_(cameras) {}

  // Copies no more than a few hundred bytes, also if there are many frames.
  void add(const InputFrame& frame);
  // Moves the frames of a later part of the run to the end.
  void append(FrameLog&& later);

  std::size_t size() const { return frames_.size(); }
  TimeNs time_ns(std::size_t i) const { return frames_[i].time_ns; }
  float read_ms(std::size_t i) const { return frames_[i].read_ms; }
  bool tracked(std::size_t i) const;
  // Meaningful while tracked.
  map::AnchoredPose pose(std::size_t i) const;
  // The part of the record that is kept: status, counts, pose relative to its keyframe, and total time; nullopt if the
  // frame was dropped.
  std::optional<tracking::FrameRecord> record(std::size_t i) const;
  // Stages in the thread that processes the frames.
  std::vector<Stage> stages(std::size_t i) const;
  const std::vector<Relocalised>& relocalised() const { return relocalised_; }

  std::size_t memory_bytes() const;

 private:
  enum Flag : std::uint8_t { kProcessed = 1, kKeyframe = 2, kDirect = 4, kContested = 8, kMapWithdrawn = 16 };
  struct Frame {
    TimeNs time_ns = 0;
    float read_ms = 0, frame_ms = 0;
    KeyframeId reference;
    float scale = 1;
    std::array<float, 7> T_rig_reference{};  // quaternion x, y, z, w, and translation
    int unique = 0, monocular = 0, matched = 0;
    std::uint32_t first_stage = 0;
    std::uint8_t stages = 0, reduction = 0, flags = 0;
    tracking::TrackStatus status = tracking::TrackStatus::kNotStarted;
    tracking::LostReason reason = tracking::LostReason::kNotStarted;

    bool has(Flag flag) const { return (flags & flag) != 0; }
  };
  struct Camera {
    int keypoints = 0, matched = 0, inliers = 0;
    tracking::CameraStatus status;
    std::uint8_t image = 0;
  };
  struct StageSample {
    float ms = 0;
    std::uint8_t name = 0;  // index into names_
  };

  std::uint8_t index_of(std::string_view name);
  void withdraw_map(std::size_t until);

  std::size_t num_cameras_;
  std::deque<Frame> frames_;    // deques, since a frame that is added must not wait until all others are copied
  std::deque<Camera> cameras_;  // num_cameras_ for each frame
  std::deque<StageSample> stages_;
  std::vector<std::string_view> names_;
  std::vector<Relocalised> relocalised_;
};

}  // namespace bslam::live_view
