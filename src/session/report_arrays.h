// Arrays of numbers in the data of the report.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace bslam::session {

std::string base64(std::string_view bytes);

// {"f32": TEXT}: the numbers as 32-bit floats, little-endian, in base64. NaN stands for a value that does not exist.
nlohmann::ordered_json float_array(std::span<const float> values);

}  // namespace bslam::session
