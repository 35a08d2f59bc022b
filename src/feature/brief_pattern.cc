#include "feature/brief_pattern.h"

#include <cmath>
#include <numbers>

#include "base/random.h"

namespace bslam::feature {
namespace {

constexpr int kReachSquared = 14 * 14;       // maximum squared offset: within the window after rotation and rounding
constexpr int kShortestSquared = 4 * 4;      // minimum squared distance of the pixels: the width of the smoothing
constexpr double kCorrelationLength = 12.0;  // pixels
constexpr std::uint64_t kSeed = 1;

int squared(int x, int y) { return x * x + y * y; }

// Correlation of grey values by squared distance; 1 is 2^14, so that the selection does not depend on rounding of exp.
class GreyCorrelation {
 public:
  GreyCorrelation() {
    for (std::size_t d2 = 0; d2 < by_distance_.size(); ++d2) {
      const double distance = std::sqrt(static_cast<double>(d2));
      by_distance_[d2] = static_cast<std::int32_t>(std::lround(kOne * std::exp(-distance / kCorrelationLength)));
    }
  }
  // Covariance of the differences of two tests.
  std::int32_t covariance(const BinaryTest& a, const BinaryTest& b) const {
    return at(a.x1 - b.x1, a.y1 - b.y1) - at(a.x1 - b.x2, a.y1 - b.y2) - at(a.x2 - b.x1, a.y2 - b.y1) +
           at(a.x2 - b.x2, a.y2 - b.y2);
  }

 private:
  static constexpr double kOne = 1 << 14;
  std::int32_t at(int dx, int dy) const { return by_distance_[static_cast<std::size_t>(squared(dx, dy))]; }
  std::array<std::int32_t, 4 * kReachSquared + 1> by_distance_;
};

// Approximately normal with standard deviation 6.2, a fifth of the 31 pixels of the pattern. A sum of uniform integers,
// because the normal distribution requires functions whose rounding differs between machines.
int draw_offset(Random& random) {
  int sum = 0;
  for (int k = 0; k < 4; ++k) sum += static_cast<int>(random.below(1073));
  return static_cast<int>(std::floor((sum - 2 * 1072) / 100.0 + 0.5));
}

BinaryTest draw_test(Random& random) {
  for (;;) {
    const int x1 = draw_offset(random), y1 = draw_offset(random), x2 = draw_offset(random), y2 = draw_offset(random);
    if (squared(x1, y1) > kReachSquared || squared(x2, y2) > kReachSquared) continue;
    if (squared(x1 - x2, y1 - y2) < kShortestSquared) continue;
    return {static_cast<std::int8_t>(x1), static_cast<std::int8_t>(y1), static_cast<std::int8_t>(x2),
            static_cast<std::int8_t>(y2)};
  }
}

}  // namespace

std::array<BinaryTest, kTestCount> make_brief_pattern() {
  const GreyCorrelation model;
  Random random(kSeed, "binary tests");
  std::array<BinaryTest, kTestCount> tests;
  std::array<std::int64_t, kTestCount> variance;
  std::int64_t bound_squared = 100;  // squared bound of the correlation, in thousandths squared
  for (std::size_t count = 0, rejected = 0; count < tests.size();) {
    const BinaryTest test = draw_test(random);
    const std::int64_t own = model.covariance(test, test);
    bool is_new = true;
    for (std::size_t k = 0; k < count && is_new; ++k) {
      const std::int64_t c = model.covariance(test, tests[k]);
      is_new = c * c * 1000 <= bound_squared * own * variance[k];
    }
    if (is_new) {
      tests[count] = test;
      variance[count++] = own;
      rejected = 0;
    } else if (++rejected == 20) {
      bound_squared += 10;
      rejected = 0;
    }
  }
  return tests;
}

double test_correlation(const BinaryTest& a, const BinaryTest& b) {
  const GreyCorrelation model;
  return model.covariance(a, b) / std::sqrt(static_cast<double>(model.covariance(a, a)) * model.covariance(b, b));
}

const Describer::Rotated& Describer::rotated_tests() {
  static const Rotated tests = rotate_tests();
  return tests;
}

Describer::Rotated Describer::rotate_tests() {
  Rotated rotated;
  const std::array<BinaryTest, kTestCount> tests = make_brief_pattern();
  for (std::size_t r = 0; r < rotated.size(); ++r) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(r) / kRotations;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto offset = [&](int x, int y) {
      const int column = static_cast<int>(std::lround(c * x - s * y)) + kWindowRadius;
      const int row = static_cast<int>(std::lround(s * x + c * y)) + kWindowRadius;
      return static_cast<std::uint16_t>(row * kWindowStride + column);
    };
    for (std::size_t t = 0; t < tests.size(); ++t) {
      rotated[r][t] = {offset(tests[t].x1, tests[t].y1), offset(tests[t].x2, tests[t].y2)};
    }
  }
  return rotated;
}

Descriptor Describer::describe(const Window& window, float angle) const {
  constexpr float kPerRadian = kRotations / (2 * std::numbers::pi_v<float>);
  const int turn = static_cast<int>(std::floor(angle * kPerRadian + 0.5f)) % kRotations;
  const std::array<Offsets, kTestCount>& tests = rotated_[turn < 0 ? turn + kRotations : turn];
  Descriptor descriptor;
  for (std::size_t word = 0; word < descriptor.size(); ++word) {
    std::uint64_t bits = 0;
    for (std::size_t t = 0; t < 64; ++t) {
      const Offsets& o = tests[word * 64 + t];
      bits |= static_cast<std::uint64_t>(window[o.first] < window[o.second]) << t;
    }
    descriptor[word] = bits;
  }
  return descriptor;
}

}  // namespace bslam::feature
