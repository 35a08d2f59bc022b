#include "frame/patch_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

namespace bslam::frame {
namespace {

constexpr int kInner = feature::kPatchSize - 2;  // samples with a gradient
constexpr int kSamples = kInner * kInner;

// The template: zero-mean samples, zero-mean gradients, and the inverse of their 2x2 Hessian.
struct Template {
  std::array<float, kSamples> value, gx, gy;
  float variance = 0;  // sum of squares of `value`
  Eigen::Matrix2f inverse_hessian;
  float weakest = 0;   // smaller eigenvalue of the Hessian
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
  t.weakest = half_trace - std::sqrt(std::max(0.0f, half_trace * half_trace - det));
  if (!(t.weakest > 1.0f * kSamples)) return std::nullopt;  // less than a grey level per pixel: an edge or nothing
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

// Level whose pixels are closest in size to the patch's when seen through the warp.
std::size_t best_level(const image::Pyramid& pyramid, double scale) {
  const auto ratio = [&](std::size_t l) { return std::max(pyramid.scale_x[l] / scale, scale / pyramid.scale_x[l]); };
  std::size_t best = 0;
  for (std::size_t l = 1; l < pyramid.size(); ++l) {
    if (ratio(l) < ratio(best)) best = l;
  }
  return best;
}

// Samples of the target at the warped patch positions around (x, y), pixels of the level. False outside the image.
bool sample_target(const image::Image& image, const Eigen::Matrix2f& A, float x, float y, std::array<float, kSamples>& out) {
  constexpr float kHalf = 0.5f * (kInner - 1), kRounding = 0.01f;
  const float reach_x = kHalf * (std::abs(A(0, 0)) + std::abs(A(0, 1)));
  const float reach_y = kHalf * (std::abs(A(1, 0)) + std::abs(A(1, 1)));
  if (!(x - reach_x >= 0 && y - reach_y >= 0 && x + reach_x < static_cast<float>(image.width() - 1) - kRounding &&
        y + reach_y < static_cast<float>(image.height() - 1) - kRounding)) {
    return false;
  }
  std::size_t i = 0;
  for (int r = 0; r < kInner; ++r) {
    const float dy = static_cast<float>(r) - kHalf;
    float px = x - A(0, 0) * kHalf + A(0, 1) * dy, py = y - A(1, 0) * kHalf + A(1, 1) * dy;
    for (int c = 0; c < kInner; ++c, ++i, px += A(0, 0), py += A(1, 0)) {
      out[i] = bilinear(image, std::max(px, 0.0f), std::max(py, 0.0f));
    }
  }
  return true;
}

// One comparison of target samples with the template.
struct Comparison {
  float gain = 0, ncc = 0, residual_variance = 0;
  Eigen::Vector2f shift;  // of the template, in its pixels, that would explain the difference
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
  c.residual_variance = squares / (kSamples - 4);
  return c;
}

}  // namespace

std::optional<Eigen::Matrix2d> patch_warp(const camera::Camera& reference_camera, const camera::Camera& target_camera,
                                          const geometry::SE3& T_target_reference, const Eigen::Vector3d& point_reference,
                                          double reference_scale) {
  const auto at_reference = reference_camera.project_with_jacobian(point_reference);
  const auto at_target = target_camera.project_with_jacobian(T_target_reference * point_reference);
  if (!at_reference || !at_target) return std::nullopt;
  Eigen::Matrix<double, 3, 2> tangent;  // of the plane that faces the reference camera
  tangent.col(0) = point_reference.unitOrthogonal();
  tangent.col(1) = point_reference.normalized().cross(tangent.col(0));
  const Eigen::Matrix2d reference = at_reference->jacobian * tangent;
  const Eigen::Matrix2d target = at_target->jacobian * (T_target_reference.rotation() * tangent.col(0)).eval() * Eigen::RowVector2d(1, 0) +
                                 at_target->jacobian * (T_target_reference.rotation() * tangent.col(1)).eval() * Eigen::RowVector2d(0, 1);
  if (!(std::abs(reference.determinant()) > 1e-12)) return std::nullopt;
  return (reference_scale * target * reference.inverse()).eval();
}

std::optional<AlignedKeypoint> align_patch(const feature::Patch& patch, const Eigen::Matrix2d& warp,
                                           const image::Pyramid& target, const Eigen::Vector2d& guess,
                                           const AlignmentOptions& options) {
  const double scale = std::sqrt(std::abs(warp.determinant()));
  if (!(scale > 0.2 && scale < 20.0) || target.size() == 0) return std::nullopt;
  const auto t = make_template(patch);
  if (!t) return std::nullopt;
  const std::size_t level = best_level(target, scale);
  const image::Image& image = target.levels[level];
  Eigen::Matrix2f A;
  A.row(0) = (warp.row(0) / target.scale_x[level]).cast<float>();
  A.row(1) = (warp.row(1) / target.scale_y[level]).cast<float>();
  const Eigen::Vector2f start(static_cast<float>(target.from_base_x(level, guess.x())),
                              static_cast<float>(target.from_base_y(level, guess.y())));
  Eigen::Vector2f at = start;
  std::array<float, kSamples> samples;
  bool converged = false;
  Comparison c;
  for (int i = 0; i < options.iterations && !converged; ++i) {
    if (!sample_target(image, A, at.x(), at.y(), samples)) return std::nullopt;
    c = compare(*t, samples);
    if (!(c.gain > 0.2f && c.gain < 5.0f)) return std::nullopt;
    at -= A * c.shift;
    if (!((at - start).norm() < options.max_shift_px)) return std::nullopt;
    converged = c.shift.squaredNorm() < 0.02f * 0.02f;
  }
  if (!converged || !(c.ncc > options.min_ncc)) return std::nullopt;
  AlignedKeypoint out;
  out.pixel = {target.to_base_x(level, at.x()), target.to_base_y(level, at.y())};
  out.sigma = options.sigma(std::sqrt(c.residual_variance / t->weakest), scale);
  out.ncc = c.ncc;
  return out;
}

}  // namespace bslam::frame
