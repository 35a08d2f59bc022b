// The median of a list of values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace bslam {

// For an even number of values, returns the larger of the two middle ones. `values` must not be empty.
template <class T>
T median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// For an even number of values, returns the smaller of the two middle ones. `values` must not be empty.
template <class T>
T lower_median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace bslam
