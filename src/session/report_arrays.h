// Arrays of numbers in the data of the report.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace bslam::session {

inline constexpr std::size_t kMaxReportPoses = 20'000;

// Maximum numbers of landmarks, and of poses and frames; larger sets are subsampled.
struct ReportLimits {
  std::size_t points = 100'000, poses = kMaxReportPoses;
};

// Returns a number n so that every n-th of `count` things are at most `limit`.
std::size_t report_stride(std::size_t count, std::size_t limit);

std::string base64(std::string_view bytes);

// {"f32": TEXT}: the numbers as 32-bit floats, little-endian, in base64. NaN stands for a value that does not exist.
nlohmann::ordered_json float_array(std::span<const float> values);

}  // namespace bslam::session
