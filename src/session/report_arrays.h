// Arrays of numbers in the data of the report.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

namespace bslam::session {

// {"f32": TEXT}: the numbers as 32-bit floats, little-endian, in base64. NaN stands for a value that does not exist.
nlohmann::ordered_json float_array(std::span<const float> values);

}  // namespace bslam::session
