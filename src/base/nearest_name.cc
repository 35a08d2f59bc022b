#include "base/nearest_name.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace bslam {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);  // distances between the processed prefix of `a` and every prefix of `b`
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

namespace {

constexpr std::size_t kTooFar = std::numeric_limits<std::size_t>::max();

// Returns the edit distance of two names if one may be a misspelling of the other, otherwise kTooFar.
std::size_t misspelling_distance(std::string_view a, std::string_view b) {
  const std::size_t distance = edit_distance(a, b);
  const std::size_t limit = std::max<std::size_t>(1, std::max(a.size(), b.size()) / 3);
  return distance <= limit ? distance : kTooFar;
}

}  // namespace

std::string nearest_name(std::string_view name, std::span<const std::string> known) {
  constexpr std::size_t kMaxLength = 200;  // bounds the quadratic cost; no known name is that long
  name = name.substr(0, kMaxLength);
  std::string nearest;
  std::size_t least = kTooFar;
  for (const std::string& candidate : known) {
    std::size_t distance = misspelling_distance(name, candidate);
    const std::size_t dot = candidate.rfind('.');
    if (dot != std::string::npos && name.find('.') == std::string_view::npos) {
      distance = std::min(distance, misspelling_distance(name, std::string_view(candidate).substr(dot + 1)));
    }
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace bslam
