#include "system/use_calibration.h"

#include <algorithm>
#include <optional>
#include <span>

#include "mapping/map_keyframe.h"

namespace bslam::system {
namespace {

// The time of the first move that is not among `known`.
std::optional<TimeNs> first_new_move(std::span<const camera::CameraMove> moves,
                                     std::span<const camera::CameraMove> known) {
  for (const camera::CameraMove& move : moves) {
    const auto same = [&](const camera::CameraMove& k) { return k.camera == move.camera && k.time_ns == move.time_ns; };
    if (std::ranges::none_of(known, same)) return move.time_ns;
  }
  return std::nullopt;
}

}  // namespace

bool use_calibration(const calibration::RigRefinement& refinement, const Config& config, map::MapDraft& draft,
                     const std::stop_token& stop) {
  const feature::FeatureModel features = config.feature_model();
  const auto moved_ns = first_new_move(refinement.rig->moves(), draft.map().rig().moves());
  calibration::apply(refinement, draft);
  mapping::adjust_globally(config.mapping, features, draft, stop);
  if (!moved_ns || stop.stop_requested()) return moved_ns.has_value();
  for (const KeyframeId k : draft.map().keyframe_ids()) {
    if (draft.map().keyframe(k).frame->time_ns >= *moved_ns)
      mapping::fuse_landmarks(k, config.mapping.fusion, features, draft);
  }
  mapping::adjust_globally(config.mapping, features, draft, stop);
  return true;
}

}  // namespace bslam::system
