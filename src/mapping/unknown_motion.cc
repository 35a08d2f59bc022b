#include "mapping/unknown_motion.h"

namespace bslam::mapping {
namespace {

constexpr double kMaxLinear_s = 0.5;    // longest interval in which the velocity is assumed to change linearly
constexpr double kMaxInterval_s = 1.5;  // up to here the mean velocity is a better guess than zero

}  // namespace

void complete_motion_of_root(KeyframeId following, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  const KeyframeId root = map.root_of(following);
  const map::BundledKeyframe &first = map.keyframe(root), &second = map.keyframe(following);
  if (root == following || !first.twist.isZero(0) || second.twist.isZero(0)) return;
  if (!frame::depends_on_motion(map.rig(), *first.frame)) return;
  const double interval_s = to_seconds(second.frame->time_ns - first.frame->time_ns);
  if (!(interval_s > 0 && interval_s <= kMaxInterval_s)) return;
  const geometry::Vector6d mean = (second.T_rig_world * first.T_rig_world.inverse()).log() / interval_s;
  draft.set_twists({{root, interval_s <= kMaxLinear_s ? (2 * mean - second.twist).eval() : mean}});
}

}  // namespace bslam::mapping
