#include "feature/orientation.h"

#include <array>
#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace bslam::feature {
namespace {

// Weights of a row: x offset, and all ones, 0 outside of the disc and in the column that is not part of the window.
struct DiscRow {
  alignas(16) std::array<std::int16_t, kWindowStride> x;
  alignas(16) std::array<std::uint8_t, kWindowStride> inside;
};

constexpr std::array<DiscRow, kWindowRows> make_disc() {
  std::array<DiscRow, kWindowRows> disc{};
  for (int r = 0; r < kWindowRows; ++r) {
    for (int c = 0; c < kWindowStride; ++c) {
      const int x = c - kWindowRadius, y = r - kWindowRadius;
      const bool inside = x * x + y * y <= kWindowRadius * (kWindowRadius + 1);  // about (R + 1/2)^2
      disc[r].x[c] = static_cast<std::int16_t>(inside ? x : 0);
      disc[r].inside[c] = inside ? 0xFF : 0;
    }
  }
  return disc;
}

constexpr std::array<DiscRow, kWindowRows> kDisc = make_disc();

}  // namespace

Moments intensity_moments_scalar(const Window& window) {
  Moments m;
  for (int r = 0; r < kWindowRows; ++r) {
    const std::uint8_t* row = window.data() + r * kWindowStride;
    int sum = 0;
    for (int c = 0; c < kWindowStride; ++c) {
      m.x += kDisc[r].x[c] * row[c];
      sum += kDisc[r].inside[c] & row[c];
    }
    m.y += (r - kWindowRadius) * sum;
  }
  return m;
}

#if defined(__SSE2__)
Moments intensity_moments(const Window& window) {
  const __m128i zero = _mm_setzero_si128();
  const auto load = [](const auto* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)); };
  __m128i mx = zero, my = zero;
  for (int r = 0; r < kWindowRows; ++r) {
    const std::uint8_t* row = window.data() + r * kWindowStride;
    const DiscRow& disc = kDisc[r];
    const __m128i left = load(row), right = load(row + 16);
    const __m128i a = _mm_madd_epi16(_mm_unpacklo_epi8(left, zero), load(disc.x.data()));
    const __m128i b = _mm_madd_epi16(_mm_unpackhi_epi8(left, zero), load(disc.x.data() + 8));
    const __m128i c = _mm_madd_epi16(_mm_unpacklo_epi8(right, zero), load(disc.x.data() + 16));
    const __m128i d = _mm_madd_epi16(_mm_unpackhi_epi8(right, zero), load(disc.x.data() + 24));
    mx = _mm_add_epi32(mx, _mm_add_epi32(_mm_add_epi32(a, b), _mm_add_epi32(c, d)));
    const __m128i sum = _mm_add_epi32(_mm_sad_epu8(_mm_and_si128(left, load(disc.inside.data())), zero),
                                      _mm_sad_epu8(_mm_and_si128(right, load(disc.inside.data() + 16)), zero));
    my = _mm_add_epi32(my, _mm_madd_epi16(sum, _mm_set1_epi32(static_cast<std::uint16_t>(r - kWindowRadius))));
  }
  const auto total = [](__m128i v) {
    v = _mm_add_epi32(v, _mm_shuffle_epi32(v, _MM_SHUFFLE(1, 0, 3, 2)));
    return _mm_cvtsi128_si32(_mm_add_epi32(v, _mm_shuffle_epi32(v, _MM_SHUFFLE(2, 3, 0, 1))));
  };
  return {total(mx), total(my)};
}
#else
Moments intensity_moments(const Window& window) { return intensity_moments_scalar(window); }
#endif

float orientation(const Moments& moments) {
  return std::atan2(static_cast<float>(moments.y), static_cast<float>(moments.x));
}

}  // namespace bslam::feature
