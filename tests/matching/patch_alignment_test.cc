#include "matching/patch_alignment.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "feature/window.h"

namespace bslam::matching {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

// A smooth texture defined at every position: waves of six to thirty pixels.
struct Texture {
  explicit Texture(std::uint64_t seed) {
    Random random(seed, "texture");
    for (auto& w : waves) {
      const double turn = random.uniform(0, 6.2831853), length = random.uniform(7, 30);
      w = {6.2831853 / length * std::cos(turn), 6.2831853 / length * std::sin(turn), random.uniform(0, 6.28),
           random.uniform(10, 20)};
    }
  }
  double operator()(const Vector2d& p) const {
    double v = 128;
    for (const auto& w : waves) v += 0.7 * w[3] * std::sin(w[0] * p.x() + w[1] * p.y() + w[2]);
    return v;
  }
  std::array<std::array<double, 4>, 8> waves;
};

// An image of the texture: point d is at `centre + warp(d)`, with gain and offset.
image::Pyramid image_of(const Texture& texture, const PatchWarp& warp, const Vector2d& centre, double gain = 1,
                        double offset = 0) {
  image::Image image(160, 120);
  const Matrix2d inverse = warp.linear.inverse();
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Vector2d pixel = Vector2d(x, y) - centre;
      Vector2d d = inverse * pixel;
      for (int i = 0; i < 4; ++i) d -= inverse * (warp(d) - pixel);
      const double v = gain * texture(d) + offset;
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(v + 0.5, 0.0, 255.0));
    }
  }
  image::Pyramid pyramid;
  image::build_pyramid(image.view(), 4, 1.2, pyramid);
  return pyramid;
}

// The patch around the texture's origin.
feature::Patch patch_of(const Texture& texture) {
  const Vector2d centre(80, 60);
  return feature::sample_patch(image_of(texture, {}, centre).levels[0].view(), 80, 60);
}

TEST(AlignPatch, RecoversSubPixelShiftsUnderAffineWarpsAndLight) {
  Random random(3, "align");
  int aligned = 0, tried = 0;
  std::vector<double> errors;
  for (std::uint64_t seed = 1; seed <= 60; ++seed, ++tried) {
    const Texture texture(seed);
    PatchWarp warp;
    warp.linear << random.uniform(0.85, 1.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2),
        random.uniform(0.85, 1.2);
    const Vector2d truth(80 + random.uniform(-0.5, 0.5), 60 + random.uniform(-0.5, 0.5));
    const auto target = image_of(texture, warp, truth, random.uniform(0.7, 1.1), random.uniform(-10, 20));
    const Vector2d initial = truth + Vector2d(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8));
    const auto found = align_patch(patch_of(texture), warp, target, initial, {});
    if (!found) continue;
    ++aligned;
    errors.push_back((found->pixel - truth).norm());
    EXPECT_LT(errors.back(), 0.2);
    EXPECT_GE(found->sigma, 0.3);  // the calibration error
  }
  EXPECT_GT(aligned, 50);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.1);
}

// Quadratic terms of the warp do not shift the result.
TEST(AlignPatch, IsNotDisplacedByWarpsOfSecondOrder) {
  const Vector2d truth(80.3, 59.8);
  std::vector<Vector2d> with, without;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Texture texture(seed);
    PatchWarp warp;
    warp.quadratic << 0.02, 0.0, 0.01, 0.0, -0.01, -0.015;
    const auto target = image_of(texture, warp, truth);
    const auto found = align_patch(patch_of(texture), warp, target, truth, {});
    const auto affine = align_patch(patch_of(texture), {warp.linear}, target, truth, {});
    if (!found || !affine) continue;
    with.push_back(found->pixel - truth);
    without.push_back(affine->pixel - truth);
  }
  ASSERT_GT(with.size(), 50);
  const auto mean = [](const std::vector<Vector2d>& errors) {
    Vector2d sum = Vector2d::Zero();
    for (const Vector2d& e : errors) sum += e;
    return (sum / static_cast<double>(errors.size())).eval();
  };
  EXPECT_LT(mean(with).norm(), 0.02);
  // The mean of x^2 and y^2 over the patch is 5.25.
  EXPECT_NEAR(mean(without).x(), 5.25 * 0.03, 0.05);
  EXPECT_NEAR(mean(without).y(), 5.25 * -0.015, 0.05);
}

TEST(AlignPatch, RejectsFlatPatchesAndOtherTextures) {
  const Texture texture(1);
  const Vector2d centre(80, 60);
  const auto target = image_of(texture, {}, centre);
  feature::Patch flat;
  flat.fill(100);
  EXPECT_FALSE(align_patch(flat, {}, target, centre, {}).has_value());
  int wrong = 0;
  for (std::uint64_t seed = 2; seed < 42; ++seed)
    wrong += align_patch(patch_of(Texture(seed)), {}, target, centre, {}).has_value();
  EXPECT_LE(wrong, 3);
}

TEST(AlignPatch, RejectsPositionsOutsideTheImageAndLargeShifts) {
  const Texture texture(1);
  const Vector2d centre(80, 60);
  const feature::Patch patch = patch_of(texture);
  const auto at_edge = image_of(texture, {}, {1, 60});
  EXPECT_FALSE(align_patch(patch, {}, at_edge, {1, 60}, {}).has_value());
  EXPECT_FALSE(align_patch(patch, {}, at_edge, {-50, 1000}, {}).has_value());
  const auto target = image_of(texture, {}, centre);
  const auto moved = align_patch(patch, {}, target, centre + Vector2d(1, 0), {.max_shift_px = 0.5});
  EXPECT_FALSE(moved.has_value());
  EXPECT_FALSE(align_patch(patch, {100 * Matrix2d::Identity()}, target, centre, {}).has_value());
  EXPECT_FALSE(align_patch(patch, {}, image::Pyramid(), centre, {}).has_value());
}

TEST(AlignPatch, RejectsQuadraticWarpsThatLeaveTheImage) {
  const Texture texture(1);
  const feature::Patch patch = patch_of(texture);
  for (const Vector2d& at : {Vector2d(6, 60), Vector2d(153, 60), Vector2d(80, 6), Vector2d(80, 113)}) {
    const auto target = image_of(texture, {}, at);
    ASSERT_TRUE(align_patch(patch, {}, target, at, {})) << at.transpose();
    for (const double quadratic : {0.6, -0.6, 1e6, std::numeric_limits<double>::infinity(), std::nan("")}) {
      PatchWarp warp;
      warp.quadratic.setConstant(quadratic);
      EXPECT_FALSE(align_patch(patch, warp, target, at, {})) << at.transpose() << " " << quadratic;
    }
  }
}

TEST(AlignPatch, WorksOnTheLevelThatFitsTheWarp) {
  const Texture texture(5);
  const double scale = 1.728;  // three levels
  const Vector2d truth(80.3, 59.8);
  const auto target = image_of(texture, {scale * Matrix2d::Identity()}, truth);
  const auto found =
      align_patch(patch_of(texture), {scale * Matrix2d::Identity()}, target, truth + Vector2d(1, -1), {});
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((found->pixel - truth).norm(), 0.2);
}

// Projects points of the plane that faces the reference camera into both images and compares.
TEST(PatchWarp, MatchesTheProjectionOfThePlane) {
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
      for (const Vector2d& step :
           {Vector2d(1e-3, 0), Vector2d(-2e-3, 1e-3), Vector2d(3, 0), Vector2d(0, -3), Vector2d(2, 3)}) {
        const Vector2d pixel = *reference.project(point) + 1.44 * step;
        const Vector3d bearing = *reference.unproject(pixel), normal = point.normalized();
        const Vector3d on_plane = bearing * (normal.dot(point) / normal.dot(bearing));
        const Vector2d moved =
            *target.project(T_target_reference * on_plane) - *target.project(T_target_reference * point);
        EXPECT_LT((moved - (*warp)(step)).norm(), 2e-3 * step.norm()) << "step " << step.transpose();
      }
    }
  }
  EXPECT_FALSE(patch_warp(cameras[0], cameras[0], SE3(), {0, 0, -1}, 1).has_value());
}

}  // namespace
}  // namespace bslam::matching
