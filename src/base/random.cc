#include "base/random.h"

#include <cmath>
#include <numbers>

#include "base/assert.h"

namespace bslam {
namespace {

std::uint64_t splitmix64(std::uint64_t& x) {
  x += 0x9e3779b97f4a7c15ull;
  std::uint64_t z = x;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

std::uint64_t rotate_left(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

}  // namespace

Random::Random(std::uint64_t seed, std::string_view stage, std::uint64_t frame) {
  std::uint64_t mix = seed;
  for (const char c : stage) mix = (splitmix64(mix) ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  mix ^= splitmix64(frame);
  for (std::uint64_t& word : state_) word = splitmix64(mix);
}

std::uint64_t Random::next() {
  const std::uint64_t result = rotate_left(state_[1] * 5, 7) * 9;
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = rotate_left(state_[3], 45);
  return result;
}

std::uint32_t Random::below(std::uint32_t n) {
  BSLAM_ASSERT(n > 0, "n must be positive");
  const std::uint64_t limit = (std::uint64_t{1} << 32) / n * n;
  std::uint64_t draw = next() >> 32;
  while (draw >= limit) draw = next() >> 32;
  return static_cast<std::uint32_t>(draw % n);
}

std::array<std::uint32_t, 3> Random::three_below(std::uint32_t n) {
  std::array<std::uint32_t, 3> out{};
  do {
    for (std::uint32_t& i : out) i = below(n);
  } while (out[0] == out[1] || out[0] == out[2] || out[1] == out[2]);
  return out;
}

double Random::uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

double Random::uniform(double low, double high) { return low + (high - low) * uniform(); }

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

}  // namespace bslam
