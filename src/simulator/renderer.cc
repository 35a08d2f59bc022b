#include "simulator/renderer.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"

namespace bslam::simulator {
namespace {

constexpr int kSubSamples = ImagingOptions::kExposurePoses;
constexpr int kGreySteps = 1 << 15;
constexpr int kPacket = RayPacket::kSize;

// Offsets of the sub-samples from the centre of the pixel. Their mean is the centre.
constexpr double kOffsetX[kSubSamples] = {-0.25, 0.25, -0.25, 0.25};
constexpr double kOffsetY[kSubSamples] = {-0.25, -0.25, 0.25, 0.25};

// The quarter of the exposure at which a sub-sample is taken. Position and time are as independent as four samples
// permit, and the remaining correlation is reversed from row to row, so that motion blur is symmetric.
constexpr int kQuarter[2][kSubSamples] = {{0, 2, 3, 1}, {3, 1, 0, 2}};

std::uint64_t mix_bits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// Approximately normal with mean 0 and standard deviation 1: the sum of four uniform numbers suffices for pixel noise.
float normal_from(std::uint64_t bits) {
  const auto sum =
      static_cast<std::int32_t>((bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  constexpr float kScale = 1.7320508f / 65536.0f;  // sqrt(12 / 4) per unit
  return kScale * static_cast<float>(sum - 2 * 65535);
}

// Replaces `count` values, which are `step` apart and start at `first`, by means over 2 radius + 1 of them. Border
// values are repeated.
void box_blur(float* first, int count, int step, int radius, std::vector<float>& line) {
  line.resize(static_cast<std::size_t>(count));
  const auto at = [&](int i) { return static_cast<std::ptrdiff_t>(std::clamp(i, 0, count - 1)); };
  for (int i = 0; i < count; ++i) line[static_cast<std::size_t>(i)] = first[static_cast<std::ptrdiff_t>(i) * step];
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += line[static_cast<std::size_t>(at(i))];
  for (int i = 0; i < count; ++i) {
    first[static_cast<std::ptrdiff_t>(i) * step] = static_cast<float>(sum / (2 * radius + 1));
    sum += static_cast<double>(line[static_cast<std::size_t>(at(i + radius + 1))]) -
           line[static_cast<std::size_t>(at(i - radius))];
  }
}

// Three box filters in each direction approximate a Gaussian.
void blur(std::vector<float>& light, int width, int height, int stride, double sigma) {
  constexpr int kBoxes = 3;
  const int radius = static_cast<int>(std::lround((std::sqrt(12 * sigma * sigma / kBoxes + 1) - 1) / 2));
  std::vector<float> line;
  for (int k = 0; radius > 0 && k < kBoxes; ++k) {
    for (int y = 0; y < height; ++y)
      box_blur(light.data() + static_cast<std::ptrdiff_t>(y) * stride, width, 1, radius, line);
    for (int x = 0; x < width; ++x) box_blur(light.data() + x, height, stride, radius, line);
  }
}

}  // namespace

Renderer::Renderer(const World& world, const camera::Camera& camera, const ImagingOptions& options)
    : world_(world), options_(options), width_(camera.width), height_(camera.height) {
  padded_width_ = (width_ + kPacket - 1) / kPacket * kPacket;
  spread_ = static_cast<float>(0.6 * camera.radians_per_pixel());
  const auto stride = static_cast<std::size_t>(padded_width_);
  bearing_.resize(static_cast<std::size_t>(height_) * kSubSamples * 3 * stride);
  weight_.resize(static_cast<std::size_t>(height_ * width_));
  const double corner2 = 0.25 * (width_ * width_ + height_ * height_);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < padded_width_; ++x) {
      const auto centre = camera.unproject({std::min(x, width_ - 1), y});
      if (x < width_) {
        const double dx = x - 0.5 * (width_ - 1), dy = y - 0.5 * (height_ - 1);
        const double vignette = 1 - options.vignetting * (dx * dx + dy * dy) / corner2;
        weight_[static_cast<std::size_t>(y * width_ + x)] = centre ? static_cast<float>(vignette) : 0.0f;
      }
      for (int k = 0; k < kSubSamples; ++k) {
        auto bearing = camera.unproject({std::min(x, width_ - 1) + kOffsetX[k], y + kOffsetY[k]});
        if (!bearing) bearing = centre ? centre : camera::Vector3d(camera::Vector3d::UnitZ());
        float* out =
            bearing_.data() + static_cast<std::size_t>(y * kSubSamples + k) * 3 * stride + static_cast<std::size_t>(x);
        for (int i = 0; i < 3; ++i) out[static_cast<std::size_t>(i) * stride] = static_cast<float>((*bearing)[i]);
      }
    }
  }
  grey_.resize(kGreySteps + 1);
  for (int i = 0; i <= kGreySteps; ++i) {
    grey_[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(
        std::lround(255.0 * std::pow(static_cast<double>(i) / kGreySteps, 1.0 / options.gamma)));
  }
}

image::Image Renderer::render(std::span<const ExposurePoses> T_world_cam, std::uint64_t noise_key, double exposure,
                              double blur_px) const {
  image::Image out(width_, height_);  // initialised with 0
  if (exposure <= 0) return out;
  const auto stride = static_cast<std::size_t>(padded_width_);
  std::vector<float> light(stride * static_cast<std::size_t>(height_));
  const auto row = [&](int y) { return std::span(light).subspan(static_cast<std::size_t>(y) * stride, stride); };
  const std::uint64_t noise_seed = mix_bits(options_.seed * 0x9e3779b97f4a7c15ull + mix_bits(noise_key + 1));
  const auto gain = static_cast<float>(options_.gain * exposure / kSubSamples);
  BSLAM_ASSERT(T_world_cam.size() == 1 || T_world_cam.size() == static_cast<std::size_t>(height_), "poses of each row");
  for (int y = 0; y < height_; ++y)
    trace_row(y, T_world_cam.size() == 1 ? T_world_cam.front() : T_world_cam[static_cast<std::size_t>(y)], row(y));
  blur(light, width_, height_, padded_width_, blur_px);
  for (int y = 0; y < height_; ++y) develop_row(y, noise_seed, gain, row(y), out);
  return out;
}

void Renderer::trace_row(int y, const ExposurePoses& T_world_cam, std::span<float> sum) const {
  const auto stride = static_cast<std::size_t>(padded_width_);
  for (int k = 0; k < kSubSamples; ++k) {
    const geometry::SE3& T = T_world_cam[static_cast<std::size_t>(kQuarter[y & 1][k])];
    const Eigen::Matrix3f R = T.matrix3().cast<float>();
    const Eigen::Vector3f origin = T.translation().cast<float>();
    const float detail = (static_cast<float>(k) + 0.5f) / kSubSamples;
    const float* bx = bearing_.data() + static_cast<std::size_t>(y * kSubSamples + k) * 3 * stride;
    const float *by = bx + stride, *bz = by + stride;
    const float* weight = weight_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = 0; x < padded_width_; x += kPacket) {
      const int end = std::min(x + kPacket, width_);
      if (std::all_of(weight + x, weight + end, [](float w) { return w == 0.0f; })) continue;
      RayPacket rays;
      for (int i = 0; i < kPacket; ++i) {
        const float cx = bx[x + i], cy = by[x + i], cz = bz[x + i];
        rays.x[i] = R(0, 0) * cx + R(0, 1) * cy + R(0, 2) * cz;
        rays.y[i] = R(1, 0) * cx + R(1, 1) * cy + R(1, 2) * cz;
        rays.z[i] = R(2, 0) * cx + R(2, 1) * cy + R(2, 2) * cz;
      }
      float radiance[kPacket];
      world_.radiance(origin, rays, spread_, detail, radiance);
      for (int i = 0; i < kPacket; ++i) sum[static_cast<std::size_t>(x + i)] += radiance[i];
    }
  }
}

void Renderer::develop_row(int y, std::uint64_t noise_seed, float gain, std::span<const float> sum,
                           image::Image& out) const {
  const auto shot = static_cast<float>(options_.noise * options_.shot_noise),
             read = static_cast<float>(options_.noise * options_.read_noise);
  const float* weight = weight_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  std::uint8_t* row = out.row(y);
  for (int x = 0; x < width_; ++x) {
    if (weight[x] == 0.0f) {
      row[x] = 0;
      continue;
    }
    float signal = sum[static_cast<std::size_t>(x)] * weight[x] * gain;
    const std::uint64_t bits =
        mix_bits(noise_seed + 0x9e3779b97f4a7c15ull * static_cast<std::uint64_t>(y * width_ + x));
    signal += normal_from(bits) * std::sqrt(shot * shot * signal + read * read);
    const float step = std::clamp(signal, 0.0f, 1.0f) * kGreySteps + 0.5f;
    row[x] = grey_[static_cast<std::size_t>(step)];
  }
}

}  // namespace bslam::simulator
