// Textured scenes and views of them under known warps, for tests of features.
#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/random.h"
#include "camera/camera.h"
#include "image/image.h"

namespace bslam::feature::testing {

inline image::ImageView view_of(const cv::Mat& grey) {
  return {grey.data, grey.cols, grey.rows, static_cast<std::ptrdiff_t>(grey.step)};
}

inline camera::Camera pinhole_camera(const cv::Size& size) {
  const camera::Pinhole model({450, 450, (size.width - 1) / 2.0, (size.height - 1) / 2.0});
  return {
      .name = "cam0", .model = model, .width = size.width, .height = size.height, .time_offset_ns = 0, .mask_file = ""};
}

// Clutter of polygons and ellipses of all sizes with a little cloudy texture, 8-bit grey.
inline cv::Mat make_scene(int width, int height, std::uint64_t seed) {
  Random random(seed, "scene");
  cv::Mat scene(height, width, CV_8U, cv::Scalar(120));
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  const int shapes = width * height / 700;
  for (int i = 0; i < shapes; ++i) {
    const cv::Point centre(below(width), below(height));
    const double size = 5.0 * std::pow(20.0, std::pow(random.uniform(), 1.7));
    const cv::Scalar grey(20 + below(216));
    if (i % 4 == 0) {
      cv::ellipse(scene, centre,
                  cv::Size(static_cast<int>(size * 0.6), static_cast<int>(size * random.uniform(0.2, 0.6))),
                  random.uniform(0, 360), 0, 360, grey, cv::FILLED, cv::LINE_AA);
      continue;
    }
    std::vector<cv::Point> corners;
    const int count = 3 + below(3);
    const double start = random.uniform(0, 2 * CV_PI);
    for (int k = 0; k < count; ++k) {
      const double angle = start + 2 * CV_PI * (k + random.uniform(-0.3, 0.3)) / count,
                   r = size * random.uniform(0.4, 1.0);
      corners.emplace_back(centre.x + static_cast<int>(r * std::cos(angle)),
                           centre.y + static_cast<int>(r * std::sin(angle)));
    }
    cv::fillConvexPoly(scene, corners, grey, cv::LINE_AA);
  }
  cv::Mat cloud(height / 8, width / 8, CV_32F);
  for (int y = 0; y < cloud.rows; ++y) {
    for (int x = 0; x < cloud.cols; ++x) cloud.at<float>(y, x) = static_cast<float>(12 * random.normal());
  }
  cv::resize(cloud, cloud, scene.size(), 0, 0, cv::INTER_CUBIC);
  cv::Mat textured;
  scene.convertTo(textured, CV_32F);
  textured += cloud;
  textured.convertTo(scene, CV_8U);
  return scene;
}

// Similarity around the centre of an image: rotation in radians (x towards y), scale, then a shift in pixels.
struct Similarity {
  double angle = 0, scale = 1, shift_x = 0, shift_y = 0;
  cv::Size size;  // of the image before and after

  cv::Point2d operator()(const cv::Point2d& p) const {
    const double cx = (size.width - 1) / 2.0, cy = (size.height - 1) / 2.0, x = p.x - cx, y = p.y - cy;
    return {cx + shift_x + scale * (std::cos(angle) * x - std::sin(angle) * y),
            cy + shift_y + scale * (std::sin(angle) * x + std::cos(angle) * y)};
  }
};

// View of `scene` under `warp`. The view without warp shows the centre of the scene at half its resolution. Rendered at
// three times the resolution of the view and averaged, so that all views have the same sampling.
inline cv::Mat render(const cv::Mat& scene, const Similarity& warp, double blur = 0, double gain = 1, double offset = 0,
                      double noise = 0, std::uint64_t seed = 1) {
  constexpr int kOver = 3;
  const cv::Size fine(warp.size.width * kOver, warp.size.height * kOver);
  // Scene pixel = 2 * inverse warp of the view's pixel, relative to the centre.
  const double c = std::cos(warp.angle) * 2 / warp.scale, s = std::sin(warp.angle) * 2 / warp.scale;
  const double vx = (warp.size.width - 1) / 2.0 + warp.shift_x, vy = (warp.size.height - 1) / 2.0 + warp.shift_y;
  const double sx = (scene.cols - 1) / 2.0, sy = (scene.rows - 1) / 2.0;
  // Fine pixel f is at view pixel (f + 0.5) / kOver - 0.5.
  const double k = 1.0 / kOver, d = 0.5 / kOver - 0.5;
  const cv::Matx23d to_scene(c * k, s * k, sx + c * (d - vx) + s * (d - vy), -s * k, c * k,
                             sy - s * (d - vx) + c * (d - vy));
  cv::Mat large, view;
  cv::warpAffine(scene, large, to_scene, fine, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REFLECT);
  cv::resize(large, view, warp.size, 0, 0, cv::INTER_AREA);
  view.convertTo(view, CV_32F, gain, offset);
  if (blur > 0) cv::GaussianBlur(view, view, cv::Size(), blur);
  Random random(seed, "noise");
  for (int y = 0; noise > 0 && y < view.rows; ++y) {
    for (int x = 0; x < view.cols; ++x) view.at<float>(y, x) += static_cast<float>(noise * random.normal());
  }
  view.convertTo(view, CV_8U);
  return view;
}

}  // namespace bslam::feature::testing
