// Rotated binary tests (Rublee et al., ICCV 2011, section 4) with a set of tests of our own.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feature/keypoints.h"
#include "feature/window.h"

namespace bslam::feature {

constexpr int kTestCount = 256;

// Is the first pixel darker than the second? Offsets from the keypoint in pixels, upright.
struct BinaryTest {
  std::int8_t x1, y1, x2, y2;
};

// The tests of every descriptor: normally distributed pairs (Calonder et al., ECCV 2010) of which only those are kept
// that say something new. Two tests are correlated as far as the four pixels they compare are, and grey values of
// natural images are correlated by distance alone, about exp(-distance / kCorrelationLength); so a pair is kept if its
// correlation with all kept before stays below a bound, which rises slowly until there are 256. Integers only decide,
// so that every machine makes the same tests.
std::array<BinaryTest, kTestCount> make_brief_pattern();

// Correlation of two tests under that model, in [-1, 1].
double test_correlation(const BinaryTest& a, const BinaryTest& b);

// Describes keypoints; holds the tests in kRotations orientations.
class Describer {
 public:
  Describer();

  // `window` of the smoothed level; `angle` in radians.
  Descriptor describe(const Window& window, float angle) const;

  // 64 steps of 5.6 degrees: an end of a test is misplaced by 0.7 pixels at most, about what rounding to pixels costs.
  static constexpr int kRotations = 64;

 private:
  struct Offsets {
    std::uint16_t first, second;  // into a Window
  };
  std::vector<std::array<Offsets, kTestCount>> rotated_;
};

}  // namespace bslam::feature
