// Seeded randomness that gives the same numbers with every standard library (xoshiro256**, seeded by splitmix64).
#pragma once

#include <cstdint>
#include <string_view>

namespace bslam {

// A generator is an argument of the stage that draws from it, never kept: Random(seed, stage, frame).
class Random {
 public:
  explicit Random(std::uint64_t seed, std::string_view stage = {}, std::uint64_t frame = 0);

  std::uint64_t next();                   // 64 random bits
  std::uint32_t below(std::uint32_t n);   // uniform in [0, n), n > 0, without bias
  double uniform();                       // uniform in [0, 1)
  double uniform(double low, double high);
  double normal();                        // mean 0, standard deviation 1 (Box-Muller)

 private:
  std::uint64_t state_[4];
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace bslam
