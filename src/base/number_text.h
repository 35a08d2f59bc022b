// Numbers as text and back, the same in every locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace bslam {

// The whole text as a finite number ("1", "-2.5e-3", "+.5"); empty for anything else, NaN and infinity included.
std::optional<double> parse_double(std::string_view text);

// The whole text as a decimal integer; empty for anything else and for what does not fit.
std::optional<std::int64_t> parse_integer(std::string_view text);

// The shortest text that reads back as the same double, always with a decimal point (as YAML wants a float).
std::string format_double(double value);

}  // namespace bslam
