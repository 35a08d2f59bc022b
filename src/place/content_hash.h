// A 64-bit hash over a sequence of numbers, identical on every machine. It is the id of a vocabulary and the checksum
// of its bytes. It detects damage and mix-ups but is not cryptographic.
#pragma once

#include <bit>
#include <cstdint>

namespace bslam::place {

class ContentHash {
 public:
  void add(std::uint64_t value) {
    state_ = std::rotl(state_ ^ (value * 0x9e3779b97f4a7c15ull), 29) * 0xbf58476d1ce4e5b9ull;
    ++count_;
  }

  std::uint64_t value() const {
    std::uint64_t h = state_ ^ count_;
    h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdull;
    h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ull;
    return h ^ (h >> 33);
  }

 private:
  std::uint64_t state_ = 0x2545f4914f6cdd1dull, count_ = 0;
};

}  // namespace bslam::place
