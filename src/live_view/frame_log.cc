#include "live_view/frame_log.h"

#include <algorithm>

namespace bslam::live_view {
namespace {

std::array<float, 7> compact(const geometry::SE3& T) {
  const auto& q = T.rotation();
  const auto& t = T.translation();
  const std::array<double, 7> values = {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
  std::array<float, 7> out{};
  std::ranges::transform(values, out.begin(), [](double value) { return static_cast<float>(value); });
  return out;
}

geometry::SE3 expanded(const std::array<float, 7>& v) {
  return {geometry::Quaterniond(v[3], v[0], v[1], v[2]), geometry::Vector3d(v[4], v[5], v[6])};
}

}  // namespace

std::uint8_t FrameLog::index_of(std::string_view name) {
  const auto at = std::ranges::find(names_, name);
  if (at != names_.end()) return static_cast<std::uint8_t>(at - names_.begin());
  names_.push_back(name);
  return static_cast<std::uint8_t>(names_.size() - 1);
}

void FrameLog::add(const InputFrame& input) {
  Frame& frame = frames_.emplace_back();
  frame.time_ns = input.time_ns;
  frame.read_ms = static_cast<float>(input.read_ms);
  cameras_.resize(cameras_.size() + num_cameras_);
  frame.first_stage = static_cast<std::uint32_t>(stages_.size());
  if (!input.record) return;
  const tracking::FrameRecord& r = *input.record;
  frame.frame_ms = static_cast<float>(r.frame_ms);
  frame.reference = r.result.anchored.reference;
  frame.scale = static_cast<float>(r.result.anchored.scale);
  frame.T_rig_reference = compact(r.result.anchored.T_rig_reference);
  frame.unique = r.unique;
  frame.monocular = r.monocular;
  frame.matched = r.matched;
  frame.reduction = static_cast<std::uint8_t>(r.reduction);
  frame.status = r.result.status;
  frame.reason = r.result.reason;
  frame.flags =
      static_cast<std::uint8_t>(kProcessed | (r.keyframe ? kKeyframe : 0) | (r.direct ? kDirect : 0) |
                                (r.result.contest.contested ? kContested : 0) | (r.map_withdrawn ? kMapWithdrawn : 0));
  for (std::size_t c = 0; c < num_cameras_; ++c) {
    Camera& camera = cameras_[cameras_.size() - num_cameras_ + c];
    if (c < r.result.cameras.size()) {
      const tracking::CameraCounts& counts = r.result.cameras[c];
      camera = {counts.keypoints, counts.matched, counts.inliers, {}, 0};
    }
    camera.status = r.cameras[c];
    camera.image = static_cast<std::uint8_t>(r.images[c]);
  }
  for (const tracking::StageTime& s : r.stages) stages_.push_back({static_cast<float>(s.ms), index_of(s.stage)});
  frame.stages = static_cast<std::uint8_t>(r.stages.size());
  if (r.relocalisation) relocalised_.push_back({input.time_ns, input.relocalised_with_ns, r.relocalisation->inliers});
}

void FrameLog::append(FrameLog&& later) {
  std::vector<std::uint8_t> name;  // of each name of `later`
  for (const std::string_view n : later.names_) name.push_back(index_of(n));
  const auto first_stage = static_cast<std::uint32_t>(stages_.size());
  for (const StageSample& s : later.stages_) stages_.push_back({s.ms, name[s.name]});
  cameras_.insert(cameras_.end(), later.cameras_.begin(), later.cameras_.end());
  relocalised_.insert(relocalised_.end(), later.relocalised_.begin(), later.relocalised_.end());
  for (Frame frame : later.frames_) {
    if (frame.has(kMapWithdrawn)) withdraw_map(frames_.size());
    frame.first_stage += first_stage;
    frames_.push_back(frame);
  }
}

// Removes the poses of a wrong initialisation together with its map.
void FrameLog::withdraw_map(std::size_t until) {
  for (std::size_t i = 0; i < until; ++i) {
    if (!tracked(i)) continue;
    frames_[i].status = tracking::TrackStatus::kLost;
    frames_[i].reason = tracking::LostReason::kNotStarted;
    frames_[i].flags = static_cast<std::uint8_t>(frames_[i].flags & ~kKeyframe);
  }
}

bool FrameLog::tracked(std::size_t i) const {
  return frames_[i].has(kProcessed) && frames_[i].status == tracking::TrackStatus::kTracking;
}

map::AnchoredPose FrameLog::pose(std::size_t i) const {
  const Frame& frame = frames_[i];
  return {frame.reference, expanded(frame.T_rig_reference), frame.scale};
}

std::optional<tracking::FrameRecord> FrameLog::record(std::size_t i) const {
  const Frame& frame = frames_[i];
  if (!frame.has(kProcessed)) return std::nullopt;
  tracking::FrameRecord out;
  out.result.time_ns = frame.time_ns;
  out.result.status = frame.status;
  out.result.reason = frame.reason;
  out.result.anchored = pose(i);
  out.result.contest.contested = frame.has(kContested);
  out.keyframe = frame.has(kKeyframe);
  out.direct = frame.has(kDirect);
  out.map_withdrawn = frame.has(kMapWithdrawn);
  out.reduction = frame.reduction;
  out.unique = frame.unique;
  out.monocular = frame.monocular;
  out.matched = frame.matched;
  out.frame_ms = static_cast<double>(frame.frame_ms);
  for (std::size_t c = 0; c < num_cameras_; ++c) {
    const Camera& camera = cameras_[i * num_cameras_ + c];
    out.result.cameras.push_back({.keypoints = camera.keypoints, .matched = camera.matched, .inliers = camera.inliers});
    out.images.push_back(static_cast<image::ImageState>(camera.image));
    out.cameras.push_back(camera.status);
  }
  return out;
}

std::vector<FrameLog::Stage> FrameLog::stages(std::size_t i) const {
  std::vector<Stage> out;
  for (std::size_t s = 0; s < frames_[i].stages; ++s) {
    const StageSample& sample = stages_[frames_[i].first_stage + s];
    out.push_back({names_[sample.name], sample.ms});
  }
  return out;
}

std::size_t FrameLog::memory_bytes() const {
  return frames_.size() * sizeof(Frame) + cameras_.size() * sizeof(Camera) + stages_.size() * sizeof(StageSample) +
         relocalised_.size() * sizeof(Relocalised);
}

}  // namespace bslam::live_view
