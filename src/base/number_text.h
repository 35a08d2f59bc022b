// Conversion of numbers to and from text, independent of the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace bslam {

// Parses the whole text as a finite number ("1", "-2.5e-3", "+.5"). Returns nullopt otherwise, including for NaN and
// infinity.
std::optional<double> parse_double(std::string_view text);

// Parses the whole text as a decimal integer. Returns nullopt otherwise, including for values that do not fit.
std::optional<std::int64_t> parse_integer(std::string_view text);

// Returns the shortest text that parses back to the same double. It always has a decimal point, as YAML requires for
// floats.
std::string format_double(double value);

}  // namespace bslam
