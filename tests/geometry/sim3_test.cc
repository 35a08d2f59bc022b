#include "geometry/sim3.h"

#include <gtest/gtest.h>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

Sim3 random_sim3(Random& random) {
  const SE3 T = random_se3(random);
  return Sim3(random.uniform(0.2, 5.0), T.rotation(), T.translation());
}

TEST(Sim3, ComposesLikeTheMapsItStandsFor) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Sim3 A = random_sim3(random), B = random_sim3(random);
    const Vector3d p = random_vector(random, 3);
    EXPECT_LT(((A * B) * p - A * (B * p)).norm(), 1e-10);
    EXPECT_LT((A.inverse() * (A * p) - p).norm(), 1e-12);
  }
}

TEST(Sim3, OfARigidTransformIsTheSameMap) {
  Random random(2);
  const SE3 T = random_se3(random);
  const Vector3d p = random_vector(random, 3);
  EXPECT_LT((Sim3(T) * p - T * p).norm(), 1e-13);
}

TEST(Sim3, MovesAPoseWithTheWorldAroundIt) {
  Random random(3);
  const Sim3 S = random_sim3(random);
  const SE3 T_b_frame = random_se3(random);
  const SE3 T_a_frame = S.apply_to_pose(T_b_frame);
  EXPECT_LT((T_a_frame * Vector3d::Zero() - S * (T_b_frame * Vector3d::Zero())).norm(), 1e-12);
  // What the frame sees keeps its direction; its distance is scaled.
  const Vector3d p_b = random_vector(random, 3);
  const Vector3d before = T_b_frame.inverse() * p_b, after = T_a_frame.inverse() * (S * p_b);
  EXPECT_LT((after - S.scale() * before).norm(), 1e-11);
}

}  // namespace
}  // namespace bslam::geometry
