#include "image/pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>

#if defined(__SSSE3__)
#include <tmmintrin.h>
#endif

#include "base/assert.h"
#include "base/vectorised.h"

namespace bslam::image {
namespace {

constexpr int kSmallestSide = 32;
constexpr int kTaps = 4;  // enough for a triangle filter of half-width 2, that is for ratios up to 2
// Number of output columns processed at a time, so that all scratch memory fits on the stack and in the L1 cache.
constexpr int kStrip = 512;
constexpr int kRowWeightSum = 1 << 8;      // sum of the vertical weights; a weighted sum of bytes fits into 16 bits
constexpr int kColumnWeightSum = 1 << 14;  // sum of the horizontal weights
constexpr int kSampleBytes = kTaps * static_cast<int>(sizeof(std::int16_t));  // of the samples of one output
constexpr int kShift = 21;  // fixed-point bits of both passes: 8 + 14, minus 1 that is dropped between them

}  // namespace

struct Resampling {
  // Weights of the input samples `first` ... `first` + 3 that contribute to an output sample.
  struct Taps {
    int first;
    std::array<int, kTaps> weight;  // they add up to kColumnWeightSum or kRowWeightSum
  };
  // One strip of output columns: the input position of each column, relative to the first input column of the strip.
  struct Strip {
    int input_begin = 0, input_count = 0, outputs = 0;
    std::array<std::int32_t, kStrip> first;
    alignas(16) std::array<std::int16_t, kStrip * kTaps> weight;
    // Positions, in the 16 bytes from the first sample of an even column, of the bytes of its samples and of those of
    // the next column.
    alignas(16) std::array<std::uint8_t, kStrip * kSampleBytes> byte;
  };

  int in_width = 0, in_height = 0, out_width = 0, out_height = 0;  // pixels
  std::vector<Strip> strips;
  std::vector<Taps> rows;  // per output row

  bool is_between(const Image& in, const Image& out) const {
    return in.width() == in_width && in.height() == in_height && out.width() == out_width && out.height() == out_height;
  }
};

namespace {

using Taps = Resampling::Taps;
using Strip = Resampling::Strip;

// Anti-aliasing with a triangle filter of half-width `ratio`, the size of an output pixel; it is bilinear interpolation
// if the ratio is 1. Samples beyond the border repeat the last one.
Taps make_taps(int i, int inputs, int outputs, int weight_sum) {
  const double ratio = static_cast<double>(inputs) / outputs;
  const double centre = (i + 0.5) * ratio - 0.5;
  const int begin = static_cast<int>(std::floor(centre)) - 1;
  Taps taps{std::clamp(begin, 0, inputs - kTaps), {}};
  std::array<double, kTaps> exact{};
  double total = 0;
  for (int k = 0; k < kTaps; ++k) {
    const double w = std::max(0.0, 1.0 - std::abs(begin + k - centre) / std::max(1.0, ratio));
    exact[std::clamp(begin + k, taps.first, taps.first + kTaps - 1) - taps.first] += w;
    total += w;
  }
  int rest = weight_sum;
  for (int k = 0; k < kTaps; ++k) {
    taps.weight[k] = static_cast<int>(std::lround(exact[k] / total * weight_sum));
    rest -= taps.weight[k];
  }
  *std::max_element(taps.weight.begin(), taps.weight.end()) += rest;
  return taps;
}

void make_strip(int begin, int end, int inputs, int outputs, Strip& strip) {
  strip.outputs = end - begin;
  for (int i = begin; i < end; ++i) {
    const Taps taps = make_taps(i, inputs, outputs, kColumnWeightSum);
    if (i == begin) strip.input_begin = taps.first;
    strip.first[i - begin] = taps.first - strip.input_begin;
    for (int k = 0; k < kTaps; ++k) strip.weight[(i - begin) * kTaps + k] = static_cast<std::int16_t>(taps.weight[k]);
    strip.input_count = taps.first + kTaps - strip.input_begin;
  }
  for (int i = 0; i < strip.outputs * kSampleBytes; ++i) {
    const int column = i / kSampleBytes;
    strip.byte[i] = static_cast<std::uint8_t>(2 * (strip.first[column] - strip.first[column & ~1]) + i % kSampleBytes);
  }
}

std::shared_ptr<const Resampling> make_resampling(const Image& in, const Image& out) {
  Resampling plan{in.width(), in.height(), out.width(), out.height(), {}, {}};
  for (int begin = 0; begin < out.width(); begin += kStrip)
    make_strip(begin, std::min(begin + kStrip, out.width()), in.width(), out.width(), plan.strips.emplace_back());
  for (int y = 0; y < out.height(); ++y) plan.rows.push_back(make_taps(y, in.height(), out.height(), kRowWeightSum));
  return std::make_shared<const Resampling>(std::move(plan));
}

// Vertical pass: `out` is half the weighted sum of four rows (15 bits).
BSLAM_VECTORISED void blend_rows(const std::array<const std::uint8_t*, kTaps>& rows,
                                 const std::array<int, kTaps>& weight, int count, std::int16_t* __restrict out) {
  const auto *r0 = rows[0], *r1 = rows[1], *r2 = rows[2], *r3 = rows[3];
  const auto w0 = static_cast<std::uint16_t>(weight[0]), w1 = static_cast<std::uint16_t>(weight[1]);
  const auto w2 = static_cast<std::uint16_t>(weight[2]), w3 = static_cast<std::uint16_t>(weight[3]);
  for (int x = 0; x < count; ++x) {
    const auto sum = static_cast<std::uint16_t>(w0 * r0[x] + w1 * r1[x] + w2 * r2[x] + w3 * r3[x]);
    out[x] = static_cast<std::int16_t>(sum >> 1);
  }
}

// Horizontal pass: from `in` (15 bits) to grey values.
BSLAM_VECTORISED void blend_columns(const Strip& strip, const std::int16_t* in, std::uint8_t* out) {
  int i = 0;
#if defined(__SSSE3__)
  const __m128i half = _mm_set1_epi32(1 << (kShift - 1));
  const auto load = [](const auto* at) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at)); };
  const auto pair = [&](int k) {  // two output pixels, each as two partial sums
    const __m128i samples = _mm_shuffle_epi8(load(in + strip.first[k]), load(strip.byte.data() + k * kSampleBytes));
    return _mm_castsi128_ps(_mm_madd_epi16(samples, load(strip.weight.data() + k * kTaps)));
  };
  for (; i + 4 <= strip.outputs; i += 4) {
    const __m128 a = pair(i), b = pair(i + 2);
    const __m128i even = _mm_castps_si128(_mm_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0)));
    const __m128i odd = _mm_castps_si128(_mm_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1)));
    const __m128i sum = _mm_srai_epi32(_mm_add_epi32(_mm_add_epi32(even, odd), half), kShift);
    const __m128i packed = _mm_packs_epi32(sum, sum);
    const int four = _mm_cvtsi128_si32(_mm_packus_epi16(packed, packed));
    std::memcpy(out + i, &four, 4);
  }
#endif
  for (; i < strip.outputs; ++i) {
    int sum = 1 << (kShift - 1);
    for (int k = 0; k < kTaps; ++k) sum += in[strip.first[i] + k] * strip.weight[i * kTaps + k];
    out[i] = static_cast<std::uint8_t>(sum >> kShift);
  }
}

void shrink(const Image& in, const Resampling& plan, Image& out) {
  // A strip covers at most kStrip * ratio input columns. The ratio may slightly exceed 2 because sizes are rounded.
  // Eight samples are read at the last pair of columns.
  alignas(16) std::array<std::int16_t, kStrip * 9 / 4 + 2 * kTaps> row;
  int begin = 0;
  for (const Strip& strip : plan.strips) {
    BSLAM_ASSERT(strip.input_count + kTaps <= static_cast<int>(row.size()),
                 "the ratio of pyramid levels must be at most 2");
    for (int y = 0; y < out.height(); ++y) {
      const Taps& taps = plan.rows[y];
      std::array<const std::uint8_t*, kTaps> rows;
      for (int k = 0; k < kTaps; ++k) rows[k] = in.row(taps.first + k) + strip.input_begin;
      blend_rows(rows, taps.weight, strip.input_count, row.data());
      blend_columns(strip, row.data(), out.row(y) + begin);
    }
    begin += strip.outputs;
  }
}

}  // namespace

void build_pyramid(const ImageView& base, int levels, double factor, Pyramid& pyramid) {
  BSLAM_ASSERT(factor > 1.0 && factor <= 2.0, "the ratio of pyramid levels must be in (1, 2]");
  pyramid.factor = factor;
  pyramid.scale_x.clear();
  pyramid.scale_y.clear();
  double scale = 1.0;
  int count = 0;
  for (; !base.empty() && count < levels; ++count, scale *= factor) {
    const int width = static_cast<int>(std::lround(base.width / scale));
    const int height = static_cast<int>(std::lround(base.height / scale));
    if (count > 0 && std::min(width, height) < kSmallestSide) break;
    if (static_cast<int>(pyramid.levels.size()) <= count) pyramid.levels.emplace_back();
    Image& level = pyramid.levels[count];
    if (level.width() != width || level.height() != height) level.resize(width, height);
    pyramid.scale_x.push_back(static_cast<double>(base.width) / width);
    pyramid.scale_y.push_back(static_cast<double>(base.height) / height);
    if (count > 0) {
      const Image& larger = pyramid.levels[count - 1];
      if (static_cast<int>(pyramid.resampling.size()) < count) pyramid.resampling.emplace_back();
      std::shared_ptr<const Resampling>& plan = pyramid.resampling[count - 1];
      if (!plan || !plan->is_between(larger, level)) plan = make_resampling(larger, level);
      shrink(larger, *plan, level);
    } else {
      for (int y = 0; y < height; ++y) std::memcpy(level.row(y), base.row(y), static_cast<std::size_t>(width));
    }
  }
  pyramid.levels.resize(count);
}

}  // namespace bslam::image
