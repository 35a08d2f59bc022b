// Renders images of the world for any camera model, with motion blur, vignetting, noise and gamma.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "camera/camera.h"
#include "geometry/se3.h"
#include "image/image.h"
#include "simulator/world.h"

namespace bslam::simulator {

struct ImagingOptions {
  double gain = 1.15;          // sensor signal (1 = saturated) per radiance
  double gamma = 1.5;          // grey = 255 * signal^(1 / gamma)
  double vignetting = 0.30;    // fraction of the light lost in the farthest corner
  double noise = 1.0;          // factor on both kinds of noise below
  double shot_noise = 0.012;   // standard deviation at signal 1; proportional to the square root of the signal
  double read_noise = 0.0015;  // standard deviation without signal
  std::uint64_t seed = 1;      // seed of the noise

  // Number of poses over which an image is averaged: sub-sample k of each pixel is taken at the fraction
  // (k + 0.5) / kExposurePoses of the exposure.
  static constexpr int kExposurePoses = 4;
};

// T_world_cam at the middle of each quarter of the exposure.
using ExposurePoses = std::array<geometry::SE3, ImagingOptions::kExposurePoses>;

// Renders the images of one camera. Immutable, and may be used from several threads.
class Renderer {
 public:
  // The world must outlive the renderer.
  Renderer(const World& world, const camera::Camera& camera, const ImagingOptions& options);

  // Renders an image with noise drawn from (options.seed, noise_key). `exposure` scales the light (1: normal, 0:
  // black). `blur_px` is the standard deviation of an approximately Gaussian blur. Pixels without a valid bearing are
  // 0. `T_world_cam`: the poses of all rows, or of a rolling shutter those of each.
  image::Image render(std::span<const ExposurePoses> T_world_cam, std::uint64_t noise_key, double exposure = 1.0,
                      double blur_px = 0.0) const;

 private:
  void trace_row(int y, const ExposurePoses& T_world_cam, std::span<float> sum) const;
  void develop_row(int y, std::uint64_t noise_seed, float gain, std::span<const float> sum, image::Image& out) const;

  const World& world_;
  ImagingOptions options_;
  int width_, height_, padded_width_;  // pixels; rows of rays are padded to full packets
  float spread_;                       // radians between neighbouring sub-samples
  std::vector<float> bearing_;         // (height, 4 sub-samples, 3, padded width): unit, camera frame
  std::vector<float> weight_;          // (height, width): vignetting, 0 without a valid bearing
  std::vector<std::uint8_t> grey_;     // grey value by finely quantised signal in [0, 1]
};

}  // namespace bslam::simulator
