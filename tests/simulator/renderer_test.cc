#include "simulator/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synthetic/rigs.h"

namespace bslam::simulator {
namespace {

using geometry::SE3;

constexpr ImagingOptions kIdeal{.gain = 0.3, .gamma = 1.0, .vignetting = 0, .noise = 0};

// A small bright square around `point`, facing the origin, in an otherwise empty world.
World world_with_square(const Vector3d& point, double size, ThreadPool& pool) {
  const Vector3d n = -point.normalized(), u = n.unitOrthogonal(), v = n.cross(u);
  Building building;
  building.surfaces.push_back({point - 0.5 * size * (u + v), size * u, size * v, {Material::kLamp, 1, 0.9f}});
  return World(std::move(building), {}, pool);
}

struct Spot {
  Vector2d centre;  // intensity-weighted
  Vector2d spread;  // standard deviations
};

Spot find_spot(const image::Image& image) {
  const int background = image.row(0)[0];
  double sum = 0;
  Vector2d first = Vector2d::Zero(), second = Vector2d::Zero();
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double w = image.row(y)[x] - background;
      if (w <= 0) continue;
      sum += w;
      first += w * Vector2d(x, y);
      second += w * Vector2d(x * x, y * y);
    }
  }
  const Vector2d mean = first / sum;
  return {mean, (second / sum - mean.cwiseAbs2()).cwiseMax(0).cwiseSqrt()};
}

std::vector<camera::Camera> cameras() {
  const camera::Intrinsics k{230, 231, 187.3, 119.1};
  return {{"pinhole", camera::Pinhole(k), 376, 240, 0, ""},
          {"radtan", camera::PinholeRadTan(k, {-0.28, 0.07, 2e-4, 2e-5}), 376, 240, 0, ""},
          {"fisheye", camera::KannalaBrandt({110, 111, 187.3, 119.1}, {-0.02, 0.004, -8e-4, 5e-5}), 376, 240, 0, ""}};
}

TEST(Renderer, RendersAPointAtItsProjection) {
  ThreadPool pool(1);
  for (const camera::Camera& camera : cameras()) {
    for (const Vector2d& pixel : {Vector2d(187.0, 120.0), Vector2d(60.5, 40.25), Vector2d(330.75, 200.6)}) {
      const Vector3d bearing = *camera.unproject(pixel);
      const World world = world_with_square(3.0 * bearing, 0.06, pool);
      const Renderer renderer(world, camera, kIdeal);
      ExposurePoses still;
      still.fill(SE3());
      const Spot spot = find_spot(renderer.render({&still, 1}, 0));
      EXPECT_NEAR(spot.centre.x(), pixel.x(), 0.06) << camera.name;
      EXPECT_NEAR(spot.centre.y(), pixel.y(), 0.06) << camera.name;
    }
  }
}

TEST(Renderer, BlursAroundTheMiddleOfTheExposure) {
  ThreadPool pool(1);
  const camera::Camera camera = cameras()[0];
  const Vector2d pixel(200.0, 130.0);
  const World world = world_with_square(3.0 * *camera.unproject(pixel), 0.05, pool);
  const Renderer renderer(world, camera, kIdeal);
  ExposurePoses still, rotating;
  still.fill(SE3());
  for (std::size_t k = 0; k < rotating.size(); ++k) {  // rotation about y: the spot moves 4 pixels along x
    const double yaw = ((static_cast<double>(k) + 0.5) / 4 - 0.5) * 4 / 230;
    rotating[k] = SE3(geometry::so3_exp({0, yaw, 0}), Vector3d::Zero());
  }
  const Spot sharp = find_spot(renderer.render({&still, 1}, 0)),
             blurred = find_spot(renderer.render({&rotating, 1}, 0));
  EXPECT_NEAR((blurred.centre - sharp.centre).norm(), 0.0, 0.06);
  EXPECT_GT(blurred.spread.x(), sharp.spread.x() + 0.2);
  EXPECT_NEAR(blurred.spread.y(), sharp.spread.y(), 0.1);
}

TEST(Renderer, RendersPixelsWithoutBearingBlack) {
  ThreadPool pool(1);
  const camera::Rig rig = synthetic::fisheye_rig(1, 128);
  const camera::Camera& camera = rig.camera(std::size_t{0});
  const World world = world_with_square({0, 0, 2}, 1.0, pool);
  ExposurePoses still;
  still.fill(SE3());
  ImagingOptions noisy;
  noisy.noise = 5;
  const image::Image picture = Renderer(world, camera, noisy).render({&still, 1}, 0);
  int outside = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (camera.unproject({x, y})) continue;
      ++outside;
      ASSERT_EQ(picture.row(y)[x], 0);
    }
  }
  EXPECT_EQ(picture.row(64)[64] > 200, true);
  RecordProperty("pixels_outside", outside);
}

TEST(Renderer, NoiseHasTheSpecifiedDeviation) {
  ThreadPool pool(1);
  const camera::Camera camera = cameras()[0];
  const World world = world_with_square({0, 0, 1}, 20.0, pool);  // fills the image
  ImagingOptions options = kIdeal;
  options.noise = 2;
  ExposurePoses still;
  still.fill(SE3());
  const Renderer renderer(world, camera, options);
  const image::Image a = renderer.render({&still, 1}, 7), b = renderer.render({&still, 1}, 8);
  double sum = 0, squares = 0, products = 0;
  const int count = camera.width * camera.height;
  double sum_b = 0;
  for (int i = 0; i < count; ++i) {
    const double x = a.row(0)[i], y = b.row(0)[i];
    sum += x;
    sum_b += y;
    squares += x * x;
    products += x * y;
  }
  const double mean = sum / count, variance = squares / count - mean * mean;
  const double signal = mean / 255, expected = 255 * options.noise *
                                               std::sqrt(options.shot_noise * options.shot_noise * signal +
                                                         options.read_noise * options.read_noise);
  EXPECT_NEAR(std::sqrt(variance), expected, 0.08 * expected + 0.1);
  EXPECT_NEAR(products / count - mean * sum_b / count, 0.0, 0.02 * variance + 0.05);  // the images are independent
}

}  // namespace
}  // namespace bslam::simulator
