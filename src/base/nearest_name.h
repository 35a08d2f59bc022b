// Suggestions for misspelt names.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace bslam {

// Returns the smallest number of single-character insertions, deletions and replacements that turn `a` into `b`
// (Levenshtein, 1966).
std::size_t edit_distance(std::string_view a, std::string_view b);

// Returns the known name closest to `name`, the first one on ties, or an empty string if none is close enough to be a
// likely misspelling. The limit is one edit for every three characters of the longer name, but at least one edit. A
// name without dots is also compared with the last component of dotted names, so that "levels" finds "features.levels".
std::string nearest_name(std::string_view name, std::span<const std::string> known);

}  // namespace bslam
