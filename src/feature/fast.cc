#include "feature/fast.h"

#include <algorithm>
#include <array>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "base/assert.h"

namespace bslam::feature {
namespace {

constexpr int kCircle = 16;
constexpr int kRadius = 3;
constexpr int kDx[kCircle] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr int kDy[kCircle] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

using CircleOffsets = std::array<std::ptrdiff_t, kCircle>;

CircleOffsets circle_offsets(std::ptrdiff_t stride) {
  CircleOffsets offsets;
  for (int k = 0; k < kCircle; ++k) offsets[k] = kDy[k] * stride + kDx[k];
  return offsets;
}

// Largest minimum over all arcs of 9 pixels; pairs of arcs with 8 common pixels are evaluated together.
// `Low` and `High` are minimum and maximum (or the reverse, for dark corners) of a scalar or a vector of pixels.
template <class Pixels, class Low, class High>
inline Pixels best_arc(const Pixels (&p)[kCircle], Low low, High high) {
  Pixels two[8], four[8];
  for (int k = 0; k < 8; ++k) two[k] = low(p[2 * k + 1], p[(2 * k + 2) % kCircle]);
  for (int k = 0; k < 8; ++k) four[k] = low(two[k], two[(k + 1) % 8]);
  Pixels best{};
  for (int k = 0; k < 8; ++k) {
    const Pixels eight = low(four[k], four[(k + 2) % 8]);
    const Pixels nine = low(eight, high(p[2 * k], p[(2 * k + 9) % kCircle]));
    best = k == 0 ? nine : high(best, nine);
  }
  return best;
}

// Scores of one pixel as a dark and as a bright corner.
struct Kinds {
  std::uint8_t dark, bright;
};

Kinds score_pixel(const std::uint8_t* pixel, const CircleOffsets& offsets) {
  int p[kCircle];
  for (int k = 0; k < kCircle; ++k) p[k] = pixel[offsets[k]];
  const auto low = [](int a, int b) { return std::min(a, b); };
  const auto high = [](int a, int b) { return std::max(a, b); };
  return {static_cast<std::uint8_t>(std::max(0, best_arc(p, low, high) - *pixel)),
          static_cast<std::uint8_t>(std::max(0, *pixel - best_arc(p, high, low)))};
}

void score_row_scalar(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, int threshold,
                      std::uint8_t* scores) {
  const CircleOffsets offsets = circle_offsets(stride);
  for (int x = begin; x < end; ++x) {
    const Kinds kinds = score_pixel(row + x, offsets);
    const std::uint8_t score = std::max(kinds.dark, kinds.bright);
    scores[x] = score > threshold ? score : std::uint8_t{0};
  }
}

void kinds_row_scalar(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, std::uint8_t* dark,
                      std::uint8_t* bright) {
  const CircleOffsets offsets = circle_offsets(stride);
  for (int x = begin; x < end; ++x) {
    const Kinds kinds = score_pixel(row + x, offsets);
    dark[x] = kinds.dark;
    bright[x] = kinds.bright;
  }
}

std::size_t local_maxima_scalar(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below,
                                int begin, int end, std::uint16_t* out) {
  std::size_t count = 0;
  for (int x = begin; x < end; ++x) {
    const std::uint8_t s = scores[x];
    if (s == 0) continue;
    const int before = std::max({above[x - 1], above[x], above[x + 1], scores[x - 1]});
    const int after = std::max({scores[x + 1], below[x - 1], below[x], below[x + 1]});
    if (s > before && s >= after) out[count++] = static_cast<std::uint16_t>(x);
  }
  return count;
}

#if defined(__SSE2__)
constexpr int kLanes = 16;

__m128i load(const std::uint8_t* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)); }
__m128i low_of(__m128i a, __m128i b) { return _mm_min_epu8(a, b); }
__m128i high_of(__m128i a, __m128i b) { return _mm_max_epu8(a, b); }
void store(std::uint8_t* p, __m128i v) { _mm_storeu_si128(reinterpret_cast<__m128i*>(p), v); }
bool all_zero(__m128i v) { return _mm_movemask_epi8(_mm_cmpeq_epi8(v, _mm_setzero_si128())) == 0xFFFF; }

struct BlockKinds {
  __m128i dark, bright;
};

BlockKinds kinds_of(const __m128i (&p)[kCircle], __m128i centre) {
  return {_mm_subs_epu8(best_arc(p, low_of, high_of), centre), _mm_subs_epu8(centre, best_arc(p, high_of, low_of))};
}

// 16 pixels at a time. An arc of 9 contains two adjacent ones of the four pixels at 0, 90, 180 and 270 degrees; this
// test rejects most blocks.
__m128i score_block(const std::uint8_t* pixel, const CircleOffsets& offsets, __m128i threshold) {
  const __m128i centre = load(pixel);
  const __m128i ceiling = _mm_adds_epu8(centre, threshold), floor = _mm_subs_epu8(centre, threshold);
  __m128i p[kCircle];
  for (int k = 0; k < kCircle; k += 4) p[k] = load(pixel + offsets[k]);
  const __m128i brighter = _mm_subs_epu8(low_of(high_of(p[0], p[8]), high_of(p[4], p[12])), ceiling);
  const __m128i darker = _mm_subs_epu8(floor, high_of(low_of(p[0], p[8]), low_of(p[4], p[12])));
  if (all_zero(_mm_or_si128(brighter, darker))) return _mm_setzero_si128();
  for (int k = 0; k < kCircle; ++k) {
    if (k % 4 != 0) p[k] = load(pixel + offsets[k]);
  }
  const BlockKinds kinds = kinds_of(p, centre);
  const __m128i score = high_of(kinds.dark, kinds.bright);
  const __m128i weak = _mm_cmpeq_epi8(_mm_subs_epu8(score, threshold), _mm_setzero_si128());
  return _mm_andnot_si128(weak, score);
}

// Calls block(x) for blocks of kLanes pixels that cover [begin, end), which must contain at least one block. The last
// block may overlap the one before.
template <class Block>
void for_blocks(int begin, int end, const Block& block) {
  for (int x = begin; x + kLanes < end; x += kLanes) block(x);
  block(end - kLanes);
}

void score_row_sse2(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, int threshold,
                    std::uint8_t* scores) {
  if (end - begin < kLanes) return score_row_scalar(row, stride, begin, end, threshold, scores);
  const CircleOffsets offsets = circle_offsets(stride);
  const __m128i t = _mm_set1_epi8(static_cast<char>(threshold));
  for_blocks(begin, end, [&](int x) { store(scores + x, score_block(row + x, offsets, t)); });
}

void kinds_row_sse2(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, std::uint8_t* dark,
                    std::uint8_t* bright) {
  if (end - begin < kLanes) return kinds_row_scalar(row, stride, begin, end, dark, bright);
  const CircleOffsets offsets = circle_offsets(stride);
  for_blocks(begin, end, [&](int x) {
    __m128i p[kCircle];
    for (int k = 0; k < kCircle; ++k) p[k] = load(row + x + offsets[k]);
    const BlockKinds kinds = kinds_of(p, load(row + x));
    store(dark + x, kinds.dark);
    store(bright + x, kinds.bright);
  });
}

std::size_t local_maxima_sse2(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below,
                              int begin, int end, std::uint16_t* out) {
  std::size_t count = 0;
  int x = begin;
  for (; x + kLanes <= end; x += kLanes) {
    const __m128i s = load(scores + x);
    if (all_zero(s)) continue;
    const __m128i before =
        high_of(high_of(load(above + x - 1), load(above + x)), high_of(load(above + x + 1), load(scores + x - 1)));
    const __m128i after =
        high_of(high_of(load(below + x - 1), load(below + x)), high_of(load(below + x + 1), load(scores + x + 1)));
    const __m128i not_above = _mm_cmpeq_epi8(_mm_subs_epu8(s, before), _mm_setzero_si128());
    const __m128i not_below = _mm_cmpeq_epi8(high_of(s, after), s);
    auto bits = static_cast<unsigned>(_mm_movemask_epi8(_mm_andnot_si128(not_above, not_below)));
    for (; bits != 0; bits &= bits - 1) out[count++] = static_cast<std::uint16_t>(x + __builtin_ctz(bits));
  }
  return count + local_maxima_scalar(above, scores, below, x, end, out + count);
}
#endif

}  // namespace

const FastKernels& scalar_fast_kernels() {
  static constexpr FastKernels kKernels{score_row_scalar, kinds_row_scalar, local_maxima_scalar};
  return kKernels;
}

const FastKernels& fast_kernels() {
#if defined(__SSE2__)
  static constexpr FastKernels kKernels{score_row_sse2, kinds_row_sse2, local_maxima_sse2};
  return kKernels;
#else
  return scalar_fast_kernels();
#endif
}

void FastDetector::detect(const image::ImageView& image, int border, int threshold, std::vector<Corner>& corners) {
  BSLAM_ASSERT(border > kRadius, "the circle of a corner and of its neighbours must lie inside of the image");
  BSLAM_ASSERT(image.width <= 0xFFFF && image.height <= 0xFFFF,
               "the image must be smaller than 65536 pixels in each axis");
  BSLAM_ASSERT(threshold >= 0 && threshold <= 254, "the FAST threshold must be in [0, 254]");
  corners.clear();
  const int begin = border, end = image.width - border, last = image.height - border;
  if (begin >= end || border >= last) return;
  const std::size_t width = static_cast<std::size_t>(image.width);
  scores_.assign(3 * width, 0);
  columns_.resize(width);
  // There is at most one maximum per 2 x 2 block; reserves memory for any image of this size.
  corners.reserve((width / 2 + 1) * (static_cast<std::size_t>(image.height) / 2 + 1));
  const auto scores_of = [&](int y) { return scores_.data() + static_cast<std::size_t>(y % 3) * width; };
  for (int y = border - 1; y <= last; ++y) {
    kernels_->score_row(image.row(y), image.stride, begin - 1, end + 1, threshold, scores_of(y));
    if (y <= border) continue;
    const std::size_t count =
        kernels_->local_maxima(scores_of(y - 2), scores_of(y - 1), scores_of(y), begin, end, columns_.data());
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint16_t x = columns_[k];
      corners.push_back({x, static_cast<std::uint16_t>(y - 1), scores_of(y - 1)[x]});
    }
  }
}

}  // namespace bslam::feature
