#include "frame/patch_alignment.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "feature/window.h"

namespace bslam::frame {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

// A smooth texture known everywhere: waves of six to thirty pixels.
struct Texture {
  explicit Texture(std::uint64_t seed) {
    Random random(seed, "texture");
    for (auto& w : waves) {
      const double turn = random.uniform(0, 6.2831853), length = random.uniform(7, 30);
      w = {6.2831853 / length * std::cos(turn), 6.2831853 / length * std::sin(turn), random.uniform(0, 6.28), random.uniform(10, 20)};
    }
  }
  double operator()(const Vector2d& p) const {
    double v = 128;
    for (const auto& w : waves) v += 0.7 * w[3] * std::sin(w[0] * p.x() + w[1] * p.y() + w[2]);
    return v;
  }
  std::array<std::array<double, 4>, 8> waves;
};

// An image that shows the texture at `A (pixel - centre) + texture_centre`, times gain plus offset.
image::Pyramid image_of(const Texture& texture, const Matrix2d& A, const Vector2d& centre, double gain = 1, double offset = 0) {
  image::Image image(160, 120);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const double v = gain * texture(A * (Vector2d(x, y) - centre)) + offset;
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(v + 0.5, 0.0, 255.0));
    }
  }
  image::Pyramid pyramid;
  image::build_pyramid(image.view(), 4, 1.2, pyramid);
  return pyramid;
}

// The patch about the texture's origin.
feature::Patch patch_of(const Texture& texture) {
  const Vector2d centre(80, 60);
  return feature::sample_patch(image_of(texture, Matrix2d::Identity(), centre).levels[0].view(), 80, 60);
}

TEST(AlignPatch, RecoversSubPixelShiftsUnderAffineWarpsAndLight) {
  Random random(3, "align");
  int aligned = 0, tried = 0;
  std::vector<double> errors;
  for (std::uint64_t seed = 1; seed <= 60; ++seed, ++tried) {
    const Texture texture(seed);
    Matrix2d warp;  // from patch to image
    warp << random.uniform(0.85, 1.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(0.85, 1.2);
    const Vector2d truth(80 + random.uniform(-0.5, 0.5), 60 + random.uniform(-0.5, 0.5));
    const auto target = image_of(texture, warp.inverse(), truth, random.uniform(0.7, 1.1), random.uniform(-10, 20));
    const Vector2d guess = truth + Vector2d(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8));
    const auto found = align_patch(patch_of(texture), warp, target, guess, {});
    if (!found) continue;
    ++aligned;
    errors.push_back((found->pixel - truth).norm());
    EXPECT_LT(errors.back(), 0.2);
    EXPECT_GT(found->ncc, 0.8);
    EXPECT_GE(found->sigma, 0.3);  // the floor
  }
  EXPECT_GT(aligned, 50);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.1);
}

TEST(AlignPatch, RefusesFlatPatchesAndOtherTextures) {
  const Texture texture(1);
  const Vector2d centre(80, 60);
  const auto target = image_of(texture, Matrix2d::Identity(), centre);
  feature::Patch flat;
  flat.fill(100);
  EXPECT_FALSE(align_patch(flat, Matrix2d::Identity(), target, centre, {}).has_value());
  int wrong = 0;
  for (std::uint64_t seed = 2; seed < 42; ++seed)
    wrong += align_patch(patch_of(Texture(seed)), Matrix2d::Identity(), target, centre, {}).has_value();
  EXPECT_LE(wrong, 3);
}

TEST(AlignPatch, RefusesToLeaveTheImageOrToMoveTooFar) {
  const Texture texture(1);
  const Vector2d centre(80, 60);
  const feature::Patch patch = patch_of(texture);
  const auto at_edge = image_of(texture, Matrix2d::Identity(), {1, 60});
  EXPECT_FALSE(align_patch(patch, Matrix2d::Identity(), at_edge, {1, 60}, {}).has_value());
  EXPECT_FALSE(align_patch(patch, Matrix2d::Identity(), at_edge, {-50, 1000}, {}).has_value());
  const auto target = image_of(texture, Matrix2d::Identity(), centre);
  const auto moved = align_patch(patch, Matrix2d::Identity(), target, centre + Vector2d(1, 0), {.max_shift_px = 0.5});
  EXPECT_FALSE(moved.has_value());
  EXPECT_FALSE(align_patch(patch, 100 * Matrix2d::Identity(), target, centre, {}).has_value());
  EXPECT_FALSE(align_patch(patch, Matrix2d::Identity(), image::Pyramid(), centre, {}).has_value());
}

TEST(AlignPatch, WorksOnTheLevelThatFitsTheWarp) {
  const Texture texture(5);
  const double scale = 1.728;  // three levels
  const Vector2d truth(80.3, 59.8);
  const auto target = image_of(texture, Matrix2d::Identity() / scale, truth);
  const auto found = align_patch(patch_of(texture), scale * Matrix2d::Identity(), target, truth + Vector2d(1, -1), {});
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((found->pixel - truth).norm(), 0.2);
}

// Projects points of the plane that faces the reference camera into both images and compares.
TEST(PatchWarp, IsTheProjectionOfTheFacingPlane) {
  const camera::Camera cameras[] = {
      {"pinhole", camera::Pinhole({400, 410, 319.5, 239.5}), 640, 480, 0, ""},
      {"radtan", camera::PinholeRadTan({458, 457, 367, 248}, {-0.283, 0.074, 2e-4, 2e-5}), 752, 480, 0, ""},
      {"fisheye", camera::KannalaBrandt({190, 190, 319.5, 319.5}, {-0.02, 0.004, -8e-4, 5e-5}), 640, 640, 0, ""}};
  const SE3 T_target_reference = SE3::exp((geometry::Vector6d() << 0.1, -0.3, 0.2, 0.2, 0.1, -0.2).finished());
  const Vector3d point(0.4, -0.3, 2.5);
  for (const camera::Camera& reference : cameras) {
    for (const camera::Camera& target : cameras) {
      const auto warp = patch_warp(reference, target, T_target_reference, point, 1.44);
      ASSERT_TRUE(warp.has_value());
      for (const Vector2d& step : {Vector2d(1e-3, 0), Vector2d(0, 1e-3), Vector2d(-2e-3, 1e-3)}) {
        const Vector2d pixel = *reference.project(point) + 1.44 * step;
        const Vector3d bearing = *reference.unproject(pixel), normal = point.normalized();
        const Vector3d on_plane = bearing * (normal.dot(point) / normal.dot(bearing));
        const Vector2d moved = *target.project(T_target_reference * on_plane) - *target.project(T_target_reference * point);
        EXPECT_LT((moved - *warp * step).norm(), 0.01 * step.norm());
      }
    }
  }
  EXPECT_FALSE(patch_warp(cameras[0], cameras[0], SE3(), {0, 0, -1}, 1).has_value());
}

}  // namespace
}  // namespace bslam::frame
