#include "matching/patch_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace bslam::matching {
namespace {

constexpr int kInner = feature::kPatchSize - 2;  // samples with a gradient
constexpr int kSamples = kInner * kInner;

// The template: zero-mean samples, zero-mean gradients, and the inverse of their 2x2 Hessian.
struct Template {
  std::array<float, kSamples> value, gx, gy;
  float variance = 0;  // sum of squares of `value`
  Eigen::Matrix2f inverse_hessian;
  float min_eigenvalue = 0;  // smaller eigenvalue of the Hessian
};

std::optional<Template> make_template(const feature::Patch& patch) {
  Template t;
  float mean = 0, mean_x = 0, mean_y = 0;
  for (int y = 0; y < kInner; ++y) {
    for (int x = 0; x < kInner; ++x) {
      const std::uint8_t* p = patch.data() + (y + 1) * feature::kPatchSize + x + 1;
      const auto i = static_cast<std::size_t>(y * kInner + x);
      t.value[i] = p[0];
      t.gx[i] = 0.5f * static_cast<float>(p[1] - p[-1]);
      t.gy[i] = 0.5f * static_cast<float>(p[feature::kPatchSize] - p[-feature::kPatchSize]);
      mean += t.value[i];
      mean_x += t.gx[i];
      mean_y += t.gy[i];
    }
  }
  constexpr float kInverse = 1.0f / kSamples;
  mean *= kInverse;
  mean_x *= kInverse;
  mean_y *= kInverse;
  float xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    t.value[i] -= mean;
    t.gx[i] -= mean_x;
    t.gy[i] -= mean_y;
    t.variance += t.value[i] * t.value[i];
    xx += t.gx[i] * t.gx[i];
    xy += t.gx[i] * t.gy[i];
    yy += t.gy[i] * t.gy[i];
  }
  const float half_trace = 0.5f * (xx + yy), det = xx * yy - xy * xy;
  t.min_eigenvalue = half_trace - std::sqrt(std::max(0.0f, half_trace * half_trace - det));
  // Root mean square gradient below one grey value per pixel in some direction: an edge or no texture.
  if (!(t.min_eigenvalue > 1.0f * kSamples)) return std::nullopt;
  t.inverse_hessian << yy / det, -xy / det, -xy / det, xx / det;
  return t;
}

float bilinear(const image::Image& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  const std::uint8_t* a = image.row(iy) + ix;
  const std::uint8_t* b = a + image.width();
  const float top = static_cast<float>(a[0]) + fx * static_cast<float>(a[1] - a[0]);
  const float bottom = static_cast<float>(b[0]) + fx * static_cast<float>(b[1] - b[0]);
  return top + fy * (bottom - top);
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

// Samples the target at the warped patch positions around (x, y), pixels of the level. Returns false if some position
// is outside the image.
bool sample_target(const image::Image& image, const LevelWarp& warp, float x, float y,
                   std::array<float, kSamples>& out) {
  constexpr float kRounding = 0.01f;
  const Eigen::Matrix2f& A = warp.linear;
  const Eigen::Matrix<float, 2, 3>& Q = warp.quadratic;
  const Eigen::Vector2f reach = kHalf * A.cwiseAbs().rowwise().sum() + kHalf * kHalf * Q.cwiseAbs().rowwise().sum();
  if (!(x - reach.x() >= 0 && y - reach.y() >= 0 && x + reach.x() < static_cast<float>(image.width() - 1) - kRounding &&
        y + reach.y() < static_cast<float>(image.height() - 1) - kRounding)) {
    return false;
  }
  std::size_t i = 0;
  for (int r = 0; r < kInner; ++r) {
    const float dx = -kHalf, dy = static_cast<float>(r) - kHalf;
    // The step from column to column increases by 2 Q_xx per column.
    Eigen::Vector2f p =
        Eigen::Vector2f(x, y) + A * Eigen::Vector2f(dx, dy) + Q * Eigen::Vector3f(dx * dx, dx * dy, dy * dy);
    Eigen::Vector2f step = A.col(0) + (2 * dx + 1) * Q.col(0) + dy * Q.col(1);
    for (int c = 0; c < kInner; ++c, ++i, p += step, step += 2 * Q.col(0)) {
      out[i] = bilinear(image, std::max(p.x(), 0.0f), std::max(p.y(), 0.0f));
    }
  }
  return true;
}

// Result of comparing target samples with the template.
struct Comparison {
  float gain = 0, ncc = 0, residual_variance = 0;
  Eigen::Vector2f shift;  // shift of the template, in its pixels, that minimises the difference
};

Comparison compare(const Template& t, const std::array<float, kSamples>& samples) {
  float mean = 0;
  for (const float s : samples) mean += s;
  mean /= kSamples;
  float cross = 0, variance = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const float v = samples[i] - mean;
    cross += v * t.value[i];
    variance += v * v;
  }
  Comparison c;
  c.gain = cross / t.variance;
  c.ncc = cross / std::sqrt(std::max(1e-6f, variance * t.variance));
  if (!(c.gain > 0)) return c;
  float bx = 0, by = 0, squares = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const float r = (samples[i] - mean) / c.gain - t.value[i];
    bx += t.gx[i] * r;
    by += t.gy[i] * r;
    squares += r * r;
  }
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
  std::array<float, kSamples> samples;
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
