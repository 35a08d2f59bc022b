// Rotated binary tests (Rublee et al., ICCV 2011, section 4) with a custom test pattern.
#pragma once

#include <array>
#include <cstdint>

#include "feature/keypoints.h"
#include "feature/window.h"

namespace bslam::feature {

constexpr int kTestCount = 256;

// The test is true if the first pixel is darker than the second. Offsets from the upright keypoint in pixels.
struct BinaryTest {
  std::int8_t x1, y1, x2, y2;
};

// The tests of every descriptor: normally distributed pairs (Calonder et al., ECCV 2010), of which only weakly
// correlated ones are kept. The correlation of two tests follows from that of the four pixels they compare. The
// correlation of grey values of natural images depends on their distance only, about exp(-distance /
// kCorrelationLength). A pair is kept if its correlation with all pairs kept before is below a bound, which is
// increased slowly until there are 256. The selection uses integers only, so that the tests are the same on all
// machines.
std::array<BinaryTest, kTestCount> make_brief_pattern();

// Correlation of two tests under that model, in [-1, 1].
double test_correlation(const BinaryTest& a, const BinaryTest& b);

// Describes keypoints. All describers share the tests in kRotations orientations, which the first one computes.
class Describer {
 public:
  Describer() : rotated_(rotated_tests()) {}

  // `window`: of the smoothed level. `angle`: radians.
  Descriptor describe(const Window& window, float angle) const;

  // 64 steps of 5.6 degrees: the maximum displacement of a test's pixel is 0.7 pixels, about the error of rounding to
  // pixels.
  static constexpr int kRotations = 64;

 private:
  struct Offsets {
    std::uint16_t first, second;  // indices into a Window
  };
  using Rotated = std::array<std::array<Offsets, kTestCount>, kRotations>;
  static Rotated rotate_tests();
  static const Rotated& rotated_tests();  // computed by the first call

  const Rotated& rotated_;
};

}  // namespace bslam::feature
