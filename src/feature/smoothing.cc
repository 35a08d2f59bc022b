#include "feature/smoothing.h"

#include <algorithm>
#include <array>

#include "base/vectorised.h"

namespace bslam::feature {
namespace {

// Each kernel sums 2 * kHalf + 1 samples s[0], s[step], ... of 8 or (after the first pass) 12 bits; 16 bits hold every
// sum.
struct Soften {
  static constexpr int kHalf = 1, kShift = 4;  // weights add up to 4 in either axis
  template <class Sample>
  static unsigned sum(const Sample& s) {
    return s(0) + 2 * s(1) + s(2);
  }
};

struct Smooth {
  static constexpr int kHalf = 3, kShift = 8;  // 16 in either axis
  template <class Sample>
  static unsigned sum(const Sample& s) {
    return 4 * s(3) + 3 * (s(2) + s(4)) + 2 * (s(1) + s(5)) + s(0) + s(6);
  }
};

template <class Kernel>
using Rows = std::array<const std::uint8_t*, 2 * Kernel::kHalf + 1>;

template <class Kernel>
[[gnu::always_inline]] inline void down(const Rows<Kernel>& in, int width, std::uint16_t* __restrict out) {
  const Rows<Kernel> rows = in;  // a copy, which cannot alias `out`
  for (int x = 0; x < width; ++x) {
    out[x] = static_cast<std::uint16_t>(Kernel::sum([&](int k) -> unsigned { return rows[k][x]; }));
  }
}

template <class Kernel>
[[gnu::always_inline]] inline void across(const std::uint16_t* __restrict in, int width, std::uint8_t* __restrict out) {
  constexpr unsigned kRound = 1u << (Kernel::kShift - 1);
  for (int x = 0; x < width; ++x) {
    const auto sum = static_cast<std::uint16_t>(Kernel::sum([&](int k) -> unsigned { return in[x + k]; }) + kRound);
    out[x] = static_cast<std::uint8_t>(sum >> Kernel::kShift);
  }
}

// One row of the output; `row`: memory for the sums of the columns and kHalf more on either side.
template <class Kernel>
[[gnu::always_inline]] inline void filter_row(const Rows<Kernel>& rows, int width, std::uint16_t* row,
                                              std::uint8_t* out) {
  constexpr int kHalf = Kernel::kHalf;
  down<Kernel>(rows, width, row + kHalf);
  std::fill_n(row, kHalf, row[kHalf]);
  std::fill_n(row + kHalf + width, kHalf, row[kHalf + width - 1]);
  across<Kernel>(row, width, out);
}

BSLAM_VECTORISED void filter_row(Soften, const Rows<Soften>& rows, int width, std::uint16_t* row, std::uint8_t* out) {
  filter_row<Soften>(rows, width, row, out);
}
BSLAM_VECTORISED void filter_row(Smooth, const Rows<Smooth>& rows, int width, std::uint16_t* row, std::uint8_t* out) {
  filter_row<Smooth>(rows, width, row, out);
}

}  // namespace

template <class Kernel>
void Smoother::filter(const image::ImageView& in, image::Image& out) {
  constexpr int kHalf = Kernel::kHalf;
  if (out.width() != in.width || out.height() != in.height) out.resize(in.width, in.height);
  if (in.empty()) return;
  row_.reserve(static_cast<std::size_t>(in.width + 2 * Smooth::kHalf));  // memory for the wider kernel
  row_.resize(static_cast<std::size_t>(in.width + 2 * kHalf));
  for (int y = 0; y < in.height; ++y) {
    Rows<Kernel> rows;
    for (int k = 0; k <= 2 * kHalf; ++k) rows[k] = in.row(std::clamp(y + k - kHalf, 0, in.height - 1));
    filter_row(Kernel(), rows, in.width, row_.data(), out.row(y));
  }
}

void Smoother::soften(const image::ImageView& in, image::Image& out) { filter<Soften>(in, out); }
void Smoother::smooth(const image::ImageView& in, image::Image& out) { filter<Smooth>(in, out); }

}  // namespace bslam::feature
