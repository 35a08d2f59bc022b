#include "matching/patch_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/vectorised.h"

namespace bslam::matching {
namespace {

constexpr int kInner = feature::kPatchSize - 2;  // samples with a gradient
constexpr int kSamples = kInner * kInner;

// A row of the patch, one lane per column. Sums over all samples are sums of one partial sum per lane.
using Lanes = float __attribute__((vector_size(sizeof(float) * kInner)));
using IntLanes = std::int32_t __attribute__((vector_size(sizeof(std::int32_t) * kInner)));
using PairLanes = std::uint16_t __attribute__((vector_size(sizeof(std::uint16_t) * kInner)));  // two pixels per lane
using ByteLanes = std::uint8_t __attribute__((vector_size(2 * kInner)));  // a pixel in every second lane
static_assert(kInner == 8);

[[gnu::always_inline]] inline float sum(const Lanes& v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

// Sets a vector to eight pixels.
[[gnu::always_inline]] inline void load(const std::uint8_t* pixels, Lanes& to) {
  ByteLanes bytes{};
  std::memcpy(&bytes, pixels, kInner);
  const ByteLanes spread =
      __builtin_shufflevector(bytes, ByteLanes{}, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  PairLanes wide;
  std::memcpy(&wide, &spread, sizeof(wide));  // little-endian
  to = __builtin_convertvector(__builtin_convertvector(wide, IntLanes), Lanes);
}

// The template: zero-mean samples, zero-mean gradients, and the inverse of their 2x2 Hessian.
struct Template {
  std::array<Lanes, kInner> value, gx, gy;
  float variance = 0;  // sum of squares of `value`
  Eigen::Matrix2f inverse_hessian;
  float min_eigenvalue = 0;  // smaller eigenvalue of the Hessian
};

// Sums of products of the zero-mean samples and gradients.
struct Moments {
  float variance = 0, xx = 0, xy = 0, yy = 0;
};

// Sets the zero-mean samples and gradients.
BSLAM_VECTORISED Moments set_samples(const std::uint8_t* patch, Template& t) {
  std::array<Lanes, feature::kPatchSize> row;  // columns 1 to 8 of the patch
  Lanes mean{}, mean_x{}, mean_y{};
  for (int y = 0; y < feature::kPatchSize; ++y) load(patch + y * feature::kPatchSize + 1, row[y]);
  for (int y = 0; y < kInner; ++y) {
    const std::uint8_t* p = patch + (y + 1) * feature::kPatchSize;
    Lanes left, right;
    load(p, left);
    load(p + 2, right);
    t.value[y] = row[y + 1];
    t.gx[y] = 0.5f * (right - left);
    t.gy[y] = 0.5f * (row[y + 2] - row[y]);
    mean += t.value[y];
    mean_x += t.gx[y];
    mean_y += t.gy[y];
  }
  constexpr float kInverse = 1.0f / kSamples;
  const float m = sum(mean) * kInverse, mx = sum(mean_x) * kInverse, my = sum(mean_y) * kInverse;
  Lanes variance{}, xx{}, xy{}, yy{};
  for (int y = 0; y < kInner; ++y) {
    t.value[y] -= m;
    t.gx[y] -= mx;
    t.gy[y] -= my;
    variance += t.value[y] * t.value[y];
    xx += t.gx[y] * t.gx[y];
    xy += t.gx[y] * t.gy[y];
    yy += t.gy[y] * t.gy[y];
  }
  return {sum(variance), sum(xx), sum(xy), sum(yy)};
}

std::optional<Template> make_template(const feature::Patch& patch) {
  Template t;
  const auto [variance, xx, xy, yy] = set_samples(patch.data(), t);
  t.variance = variance;
  const float half_trace = 0.5f * (xx + yy), det = xx * yy - xy * xy;
  t.min_eigenvalue = half_trace - std::sqrt(std::max(0.0f, half_trace * half_trace - det));
  // Root mean square gradient below one grey value per pixel in some direction: an edge or no texture.
  if (!(t.min_eigenvalue > 1.0f * kSamples)) return std::nullopt;
  t.inverse_hessian << yy / det, -xy / det, -xy / det, xx / det;
  return t;
}

// Returns the level whose pixel size is closest to the size of a patch pixel in the target, `scale`.
std::size_t best_level(const image::Pyramid& pyramid, double scale) {
  const auto ratio = [&](std::size_t l) { return std::max(pyramid.scale_x[l] / scale, scale / pyramid.scale_x[l]); };
  std::size_t best = 0;
  for (std::size_t l = 1; l < pyramid.size(); ++l) {
    if (ratio(l) < ratio(best)) best = l;
  }
  return best;
}

constexpr float kHalf = 0.5f * (kInner - 1);  // distance of the outermost samples from the centre, pixels

// A warp in pixels of a level of the target.
struct LevelWarp {
  Eigen::Matrix2f linear;
  Eigen::Matrix<float, 2, 3> quadratic;
};

LevelWarp on_level(const PatchWarp& warp, const image::Pyramid& pyramid, std::size_t level) {
  const Eigen::Vector2d per_pixel(1.0 / pyramid.scale_x[level], 1.0 / pyramid.scale_y[level]);
  return {(per_pixel.asDiagonal() * warp.linear).cast<float>(),
          (per_pixel.asDiagonal() * warp.quadratic).cast<float>()};
}

// Samples the image by bilinear interpolation at the warped patch positions around (x, y), which must be inside of it.
BSLAM_VECTORISED void sample_inside(const std::uint8_t* pixels, int width, const LevelWarp& warp, float x, float y,
                                    std::array<Lanes, kInner>& out) {
  const float a00 = warp.linear(0, 0), a01 = warp.linear(0, 1), a10 = warp.linear(1, 0), a11 = warp.linear(1, 1);
  const Eigen::Matrix<float, 2, 3>& Q = warp.quadratic;
  const Lanes dx = {0 - kHalf, 1 - kHalf, 2 - kHalf, 3 - kHalf, 4 - kHalf, 5 - kHalf, 6 - kHalf, 7 - kHalf};
  const Lanes along_x = x + dx * (a00 + dx * Q(0, 0)), along_y = y + dx * (a10 + dx * Q(1, 0));
  for (int r = 0; r < kInner; ++r) {
    const float dy = static_cast<float>(r) - kHalf;
    const Lanes warped_x = along_x + dx * (dy * Q(0, 1)) + dy * (a01 + dy * Q(0, 2)),
                warped_y = along_y + dx * (dy * Q(1, 1)) + dy * (a11 + dy * Q(1, 2));
    const Lanes px = warped_x > 0 ? warped_x : Lanes{}, py = warped_y > 0 ? warped_y : Lanes{};
    const IntLanes ix = __builtin_convertvector(px, IntLanes), iy = __builtin_convertvector(py, IntLanes);
    const IntLanes offset = iy * width + ix;
    std::array<std::uint16_t, kInner> above, below;  // pixels ix and ix + 1 of rows iy and iy + 1
    for (int i = 0; i < kInner; ++i) {
      std::memcpy(&above[i], pixels + offset[i], 2);
      std::memcpy(&below[i], pixels + offset[i] + width, 2);
    }
    PairLanes pairs;
    std::memcpy(&pairs, above.data(), sizeof(pairs));
    const IntLanes top = __builtin_convertvector(pairs, IntLanes);
    std::memcpy(&pairs, below.data(), sizeof(pairs));
    const IntLanes bottom = __builtin_convertvector(pairs, IntLanes);
    const Lanes fx = px - __builtin_convertvector(ix, Lanes), fy = py - __builtin_convertvector(iy, Lanes);
    const Lanes a = __builtin_convertvector(top & 255, Lanes), b = __builtin_convertvector(top >> 8, Lanes),
                c = __builtin_convertvector(bottom & 255, Lanes), d = __builtin_convertvector(bottom >> 8, Lanes);
    const Lanes upper = a + fx * (b - a), lower = c + fx * (d - c);
    out[r] = upper + fy * (lower - upper);
  }
}

// Samples the target at the warped patch positions around (x, y), pixels of the level. Returns false if some position
// is outside the image.
bool sample_target(const image::Image& image, const LevelWarp& warp, float x, float y, std::array<Lanes, kInner>& out) {
  constexpr float kRounding = 0.01f;
  const Eigen::Matrix2f& A = warp.linear;
  const Eigen::Matrix<float, 2, 3>& Q = warp.quadratic;
  const Eigen::Vector2f reach = kHalf * A.cwiseAbs().rowwise().sum() + kHalf * kHalf * Q.cwiseAbs().rowwise().sum();
  if (!(x - reach.x() >= 0 && y - reach.y() >= 0 && x + reach.x() < static_cast<float>(image.width() - 1) - kRounding &&
        y + reach.y() < static_cast<float>(image.height() - 1) - kRounding)) {
    return false;
  }
  sample_inside(image.row(0), image.width(), warp, x, y, out);
  return true;
}

// Result of comparing target samples with the template.
struct Comparison {
  float gain = 0, ncc = 0, residual_variance = 0;
  Eigen::Vector2f shift;  // shift of the template, in its pixels, that minimises the difference
};

// Sums of products of zero-mean target samples with themselves and with the template.
struct Correlation {
  float mean = 0, cross = 0, variance = 0;
};

BSLAM_VECTORISED Correlation correlate(const Template& t, const std::array<Lanes, kInner>& samples) {
  Lanes total{}, cross{}, variance{};
  for (const Lanes& row : samples) total += row;
  const float mean = sum(total) / kSamples;
  for (int y = 0; y < kInner; ++y) {
    const Lanes v = samples[y] - mean;
    cross += v * t.value[y];
    variance += v * v;
  }
  return {mean, sum(cross), sum(variance)};
}

// Right side of the normal equations of the shift, and the sum of squared differences.
struct Difference {
  float bx = 0, by = 0, squares = 0;
};

BSLAM_VECTORISED Difference difference(const Template& t, const std::array<Lanes, kInner>& samples, float mean,
                                       float inverse_gain) {
  Lanes bx{}, by{}, squares{};
  for (int y = 0; y < kInner; ++y) {
    const Lanes r = (samples[y] - mean) * inverse_gain - t.value[y];
    bx += t.gx[y] * r;
    by += t.gy[y] * r;
    squares += r * r;
  }
  return {sum(bx), sum(by), sum(squares)};
}

Comparison compare(const Template& t, const std::array<Lanes, kInner>& samples) {
  const auto [mean, cross, variance] = correlate(t, samples);
  Comparison c;
  c.gain = cross / t.variance;
  c.ncc = cross / std::sqrt(std::max(1e-6f, variance * t.variance));
  if (!(c.gain > 0)) return c;
  const auto [bx, by, squares] = difference(t, samples, mean, 1.0f / c.gain);
  c.shift = t.inverse_hessian * Eigen::Vector2f(bx, by);
  c.residual_variance = squares / (kSamples - 4);  // four estimated parameters: shift (2), gain, offset
  return c;
}

// Coefficients of x^2, x y and y^2 of a camera's projection of point + basis * (x, y), by central differences over the
// patch. `centre`: projection of `point`. Returns nullopt if a point of the patch cannot be projected.
std::optional<Eigen::Matrix<double, 2, 3>> second_order(const camera::Camera& camera, const Eigen::Vector3d& point,
                                                        const Eigen::Matrix<double, 3, 2>& basis,
                                                        const Eigen::Vector2d& centre) {
  constexpr double h = kHalf;
  const auto half_second_difference = [&](const Eigen::Vector2d& step) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector3d move = basis * step;
    const auto ahead = camera.project(point + move), behind = camera.project(point - move);
    if (!ahead || !behind) return std::nullopt;
    return ((*ahead + *behind - 2 * centre) / (2 * h * h)).eval();
  };
  const auto xx = half_second_difference({h, 0}), yy = half_second_difference({0, h}),
             all = half_second_difference({h, h});
  if (!xx || !yy || !all) return std::nullopt;
  Eigen::Matrix<double, 2, 3> out;
  out << *xx, *all - *xx - *yy, *yy;
  return out;
}

}  // namespace

std::optional<PatchWarp> patch_warp(const camera::Camera& reference_camera, const camera::Camera& target_camera,
                                    const geometry::SE3& T_target_reference, const Eigen::Vector3d& point_reference,
                                    double reference_scale) {
  const Eigen::Vector3d point_target = T_target_reference * point_reference;
  const auto at_reference = reference_camera.project_with_jacobian(point_reference);
  const auto at_target = target_camera.project_with_jacobian(point_target);
  if (!at_reference || !at_target) return std::nullopt;
  Eigen::Matrix<double, 3, 2> plane;  // basis of the plane that faces the reference camera
  plane.col(0) = point_reference.unitOrthogonal();
  plane.col(1) = point_reference.normalized().cross(plane.col(0));
  const Eigen::Matrix2d reference = at_reference->jacobian * plane;
  if (!(std::abs(reference.determinant()) > 1e-12)) return std::nullopt;
  plane *= reference_scale * reference.inverse();  // a unit step is one pixel of the reference level, to first order
  Eigen::Matrix<double, 3, 2> plane_target;        // the same basis in the frame of the target camera
  plane_target << T_target_reference.rotation() * plane.col(0), T_target_reference.rotation() * plane.col(1);
  const auto quadratic_reference = second_order(reference_camera, point_reference, plane, at_reference->pixel);
  const auto quadratic_target = second_order(target_camera, point_target, plane_target, at_target->pixel);
  if (!quadratic_reference || !quadratic_target) return std::nullopt;
  PatchWarp warp;
  warp.linear = at_target->jacobian * plane_target;
  warp.quadratic = *quadratic_target - warp.linear / reference_scale * *quadratic_reference;
  return warp;
}

std::optional<AlignedKeypoint> align_patch(const feature::Patch& patch, const PatchWarp& warp,
                                           const image::Pyramid& target, const Eigen::Vector2d& initial,
                                           const AlignmentOptions& options) {
  const double scale = std::sqrt(std::abs(warp.linear.determinant()));
  if (!(scale > 0.2 && scale < 20.0) || target.size() == 0) return std::nullopt;
  const auto t = make_template(patch);
  if (!t) return std::nullopt;
  const std::size_t level = best_level(target, scale);
  const image::Image& image = target.levels[level];
  const LevelWarp on_image = on_level(warp, target, level);
  const Eigen::Vector2f start(static_cast<float>(target.from_base_x(level, initial.x())),
                              static_cast<float>(target.from_base_y(level, initial.y())));
  Eigen::Vector2f at = start;
  std::array<Lanes, kInner> samples;
  bool converged = false;
  Comparison c;
  for (int i = 0; i < options.iterations && !converged; ++i) {
    if (!sample_target(image, on_image, at.x(), at.y(), samples)) return std::nullopt;
    c = compare(*t, samples);
    if (!(c.gain > 0.2f && c.gain < 5.0f)) return std::nullopt;
    at -= on_image.linear * c.shift;
    if (!((at - start).norm() < options.max_shift_px)) return std::nullopt;
    converged = c.shift.squaredNorm() < 0.02f * 0.02f;
  }
  if (!converged || !(c.ncc > options.min_ncc)) return std::nullopt;
  AlignedKeypoint out;
  out.pixel = {target.to_base_x(level, at.x()), target.to_base_y(level, at.y())};
  out.sigma = options.sigma(std::sqrt(c.residual_variance / t->min_eigenvalue), scale);
  return out;
}

}  // namespace bslam::matching
