#include "mapping/unknown_motion.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::mapping {
namespace {

using geometry::SE3;
using geometry::Vector6d;

constexpr TimeNs kInterval = 200'000'000;

// Two keyframes of a rig that accelerates along a line; the second camera captures late.
class UnknownMotion : public ::testing::Test {
 protected:
  static constexpr double kStart = 0.6, kAcceleration = 2.0;  // m/s, m/s^2
  static Vector6d twist_at(double t) { return (kStart + kAcceleration * t) * Vector6d::Unit(5); }

  KeyframeId add(TimeNs time_ns, TimeNs delay_ns, KeyframeId parent) {
    const double t = to_seconds(time_ns);
    auto frame = std::make_shared<frame::BundledFrame>(*map::synthetic_frame(random_, 2, 30, 10));
    frame->time_ns = time_ns;
    frame->twist = parent.valid() ? twist_at(t) : Vector6d::Zero();
    for (std::size_t c = 0; c < 2; ++c) {
      frame->cameras[c].state = image::ImageState::kPresent;
      frame->cameras[c].time_ns = time_ns + (c == 1 ? delay_ns : 0);
    }
    const Eigen::Vector3d moved(0, 0, kStart * t + 0.5 * kAcceleration * t * t);
    return map_.add_keyframe(frame, SE3(geometry::Quaterniond::Identity(), moved), {}, parent);
  }
  Vector6d root_twist(KeyframeId following) const {
    map::MapDraft draft(std::make_shared<const map::BundledMap>(map_));
    complete_motion_of_root(following, draft);
    return draft.map().keyframe(draft.map().root_of(following)).twist;
  }

  Random random_{3, "unknown motion"};
  map::BundledMap map_{map::synthetic_rig(2)};
};

TEST_F(UnknownMotion, IsExtrapolatedFromTheNextKeyframe) {
  const KeyframeId root = add(0, 10'000'000, {}), next = add(kInterval, 10'000'000, root);
  EXPECT_TRUE(root_twist(next).isApprox(twist_at(0), 1e-9));
}

// At three frames per second, keyframes are that far apart.
TEST_F(UnknownMotion, IsTheMeanOneIfTheNextKeyframeIsFartherAway) {
  const KeyframeId root = add(0, 10'000'000, {}), next = add(4 * kInterval, 10'000'000, root);
  EXPECT_TRUE(root_twist(next).isApprox(twist_at(0.4), 1e-9));
}

TEST_F(UnknownMotion, StaysIfItDoesNotMatterOrTheNextKeyframeIsFar) {
  const KeyframeId root = add(0, 0, {}), next = add(kInterval, 0, root);
  EXPECT_TRUE(root_twist(next).isZero(0));
  const KeyframeId late_root = add(0, 10'000'000, {}), far = add(8 * kInterval, 10'000'000, late_root);
  EXPECT_TRUE(root_twist(far).isZero(0));
}

}  // namespace
}  // namespace bslam::mapping
