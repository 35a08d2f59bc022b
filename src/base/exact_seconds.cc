#include "base/exact_seconds.h"

#include <cstddef>
#include <cstdint>

namespace bslam {

std::string exact_seconds(TimeNs time_ns) {
  constexpr std::size_t kDecimals = 9;
  const auto bits = static_cast<std::uint64_t>(time_ns);
  std::string digits = std::to_string(time_ns < 0 ? -bits : bits);
  if (digits.size() <= kDecimals) digits.insert(0, kDecimals + 1 - digits.size(), '0');
  digits.insert(digits.size() - kDecimals, 1, '.');
  return (time_ns < 0 ? "-" : "") + digits;
}

}  // namespace bslam
