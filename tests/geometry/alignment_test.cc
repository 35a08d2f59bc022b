#include "geometry/alignment.h"

#include <gtest/gtest.h>

#include <vector>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

std::vector<Vector3d> cloud(Random& random, int count, const Vector3d& extent) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.push_back(random_vector(random, 1.0).cwiseProduct(extent));
  return points;
}

std::vector<Vector3d> mapped(const Sim3& S, const std::vector<Vector3d>& points) {
  std::vector<Vector3d> out;
  for (const Vector3d& p : points) out.push_back(S * p);
  return out;
}

double squared_error(const Sim3& S, const std::vector<Vector3d>& src, const std::vector<Vector3d>& dst) {
  double sum = 0;
  for (std::size_t i = 0; i < src.size(); ++i) sum += (dst[i] - S * src[i]).squaredNorm();
  return sum;
}

TEST(Alignment, FindsTheRigidTransform) {
  Random random(1);
  for (const Vector3d& extent : {Vector3d(3, 3, 3), Vector3d(3, 3, 0), Vector3d(5, 0.01, 0.001)}) {
    const auto src = cloud(random, 30, extent);
    const SE3 T = random_se3(random);
    const auto found = align_points(src, mapped(Sim3(T), src), ScaleMode::kFixed);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->scale(), 1.0);
    EXPECT_LT(squared_error(*found, src, mapped(Sim3(T), src)), 1e-20);
  }
}

TEST(Alignment, FindsTheScale) {
  Random random(2);
  const auto src = cloud(random, 30, {3, 2, 1});
  const SE3 T = random_se3(random);
  const Sim3 S(0.37, T.rotation(), T.translation());
  const auto found = align_points(src, mapped(S, src), ScaleMode::kFree);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale(), 0.37, 1e-13);
  EXPECT_LT((found->translation() - S.translation()).norm(), 1e-12);
  EXPECT_LT(found->rotation().angularDistance(S.rotation()), 1e-7);
}

TEST(Alignment, ReturnsARotationWithoutReflection) {
  Random random(3);
  const auto src = cloud(random, 20, {2, 2, 2});
  std::vector<Vector3d> dst;
  for (const Vector3d& p : src) dst.push_back({-p.x(), p.y(), p.z()});
  const auto found = align_points(src, dst, ScaleMode::kFixed);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation().toRotationMatrix().determinant(), 1.0, 1e-12);
}

TEST(Alignment, IsAMinimum) {
  Random random(4);
  const auto src = cloud(random, 40, {3, 2, 1});
  auto dst = mapped(Sim3(2.0, so3_exp({0.3, -0.2, 0.9}), {1, 2, 3}), src);
  for (Vector3d& p : dst) p += 0.1 * Vector3d(random.normal(), random.normal(), random.normal());
  const Sim3 best = align_points(src, dst, ScaleMode::kFree).value();
  const double least = squared_error(best, src, dst);
  for (int i = 0; i < 200; ++i) {
    const Sim3 other(best.scale() * (1 + random.uniform(-0.01, 0.01)),
                     so3_exp(random_vector(random, 0.01)) * best.rotation(),
                     best.translation() + random_vector(random, 0.01));
    EXPECT_GE(squared_error(other, src, dst), least);
  }
}

TEST(Alignment, ReturnsNulloptIfTheRotationIsUndetermined) {
  std::vector<Vector3d> line, point(5, Vector3d(1, 2, 3));
  for (int i = 0; i < 10; ++i) line.push_back(Vector3d(1, 1, 2) * i + Vector3d(5, 5, 5));
  EXPECT_FALSE(align_points(line, line, ScaleMode::kFixed));
  EXPECT_FALSE(align_points(point, point, ScaleMode::kFree));
  const std::vector<Vector3d> two = {{0, 0, 0}, {1, 0, 0}};
  EXPECT_FALSE(align_points(two, two, ScaleMode::kFixed));
}

}  // namespace
}  // namespace bslam::geometry
