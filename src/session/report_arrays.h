// Arrays of numbers in the data of the report.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>

namespace bslam::session {

inline constexpr std::size_t kMaxReportPoints = 100'000;  // landmarks in the report
inline constexpr std::size_t kMaxReportPoses = 20'000;    // poses and frames in the report

// Returns a number n so that every n-th of `count` things are at most `limit`.
std::size_t report_stride(std::size_t count, std::size_t limit);

// {"f32": TEXT}: the numbers as 32-bit floats, little-endian, in base64. NaN stands for a value that does not exist.
nlohmann::ordered_json float_array(std::span<const float> values);

}  // namespace bslam::session
