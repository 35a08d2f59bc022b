// Suggests the intended name for a misspelt one.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace bslam {

// Levenshtein distance (1966): the smallest number of single-character insertions, deletions and replacements that turn
// `a` into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b);

// Returns the known name with the smallest edit distance to `name`; the first one on ties. A name without a dot is also
// compared with the last component of dotted names, so that "levels" finds "features.levels". Returns an empty string
// if `known` is empty.
std::string nearest_name(std::string_view name, std::span<const std::string> known);

}  // namespace bslam
