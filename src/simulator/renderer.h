// Pictures of the world as a camera of any model takes them: motion blur, vignetting, noise, gamma.
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
  double vignetting = 0.30;    // share of light lost in the farthest corner
  double noise = 1.0;          // multiplies both kinds of noise below
  double shot_noise = 0.012;   // standard deviation of the signal at signal 1; grows with the signal's root
  double read_noise = 0.0015;  // standard deviation of the signal in the dark
  std::uint64_t seed = 1;      // of the noise

  // Poses a picture averages over: sub-sample k of each pixel is taken at the share (k + 0.5) / kExposurePoses of the
  // exposure.
  static constexpr int kExposurePoses = 4;
};

// T_world_cam at the middles of the quarters of the exposure.
using ExposurePoses = std::array<geometry::SE3, ImagingOptions::kExposurePoses>;

// Renders one camera's pictures; immutable, to be shared between threads.
class Renderer {
 public:
  // The world must outlive the renderer.
  Renderer(const World& world, const camera::Camera& camera, const ImagingOptions& options);

  // The picture with its noise drawn from (options.seed, noise_key); `exposure` scales the light (1 = as usual, 0 =
  // all black), `blur_px` is the standard deviation, nearly Gaussian, of what is out of focus. Pixels without a bearing
  // are 0.
  image::Image render(const ExposurePoses& T_world_cam, std::uint64_t noise_key, double exposure = 1.0,
                      double blur_px = 0.0) const;

 private:
  void trace_row(int y, const ExposurePoses& T_world_cam, std::span<float> sum) const;
  void develop_row(int y, std::uint64_t noise_seed, float gain, std::span<const float> sum, image::Image& out) const;

  const World& world_;
  ImagingOptions options_;
  int width_, height_, padded_width_;  // pixels; rows of rays are padded to whole packets
  float spread_;                       // radians between neighbouring sub-samples
  std::vector<float> bearing_;         // (height, 4 sub-samples, 3, padded width): unit, camera frame
  std::vector<float> weight_;          // (height, width): vignetting, 0 without a bearing
  std::vector<std::uint8_t> grey_;     // of the signal in [0, 1], finely quantised
};

}  // namespace bslam::simulator
