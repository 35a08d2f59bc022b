// Seeded pseudo-random numbers (xoshiro256**, seeded by splitmix64). Those of next(), below() and uniform() are
// identical on every platform; the last bits of those of normal() depend on the mathematical library.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace bslam {

// A stage that draws random numbers takes a generator as an argument and never stores it: Random(seed, stage, frame).
class Random {
 public:
  explicit Random(std::uint64_t seed, std::string_view stage = {}, std::uint64_t frame = 0);

  std::uint64_t next();                                       // 64 random bits
  std::uint32_t below(std::uint32_t n);                       // uniform in [0, n), n > 0, unbiased
  std::array<std::uint32_t, 3> three_below(std::uint32_t n);  // three different numbers of [0, n), n > 2
  double uniform();                                           // uniform in [0, 1)
  double uniform(double low, double high);
  double normal();  // mean 0, standard deviation 1 (Box-Muller)

 private:
  std::uint64_t state_[4];
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace bslam
