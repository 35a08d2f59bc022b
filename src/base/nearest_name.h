// What was meant by a misspelt name.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace bslam {

// Least number of single-character insertions, deletions and replacements that turn `a` into `b` (Levenshtein, 1966).
std::size_t edit_distance(std::string_view a, std::string_view b);

// The known name nearest to `name`, the first of equals. A name without dots is also compared with the last part of
// dotted ones, so that "levels" finds "features.levels". Empty where nothing is known.
std::string nearest_name(std::string_view name, std::span<const std::string> known);

}  // namespace bslam
