// numpy arrays of the numbers in public structs.
#pragma once

#include <bslam/pose.h>
#include <bslam/trajectory.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace bslam::python {

namespace nb = nanobind;

template <class T, auto... kShape>
using Array = nb::ndarray<nb::numpy, T, nb::shape<kShape...>>;
using Matrix4x4 = Array<double, 4, 4>;
using Matrix6x6 = Array<double, 6, 6>;
using Vector3 = Array<double, 3>;
using Rows3 = Array<double, -1, 3>;  // (n, 3)
using Rows8 = Array<double, -1, 8>;  // (n, 8)
using Integers = Array<std::int64_t, -1>;

// Returns an array that owns `values`, without a copy. The number of values must be the product of `shape`.
template <class ArrayType, class T>
ArrayType make_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  T* const data = owned->data();
  const nb::capsule owner(owned.get(), [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  owned.release();  // belongs to the capsule
  return ArrayType(data, shape, owner);
}

template <class ArrayType, class Numbers>
ArrayType array_of(const Numbers& numbers, std::initializer_list<std::size_t> shape) {
  return make_array<ArrayType>(std::vector<double>(numbers.begin(), numbers.end()), shape);
}

inline Matrix4x4 matrix_of(const Pose& pose) { return array_of<Matrix4x4>(pose.matrix(), {4, 4}); }

// The rows t, x, y, z, qx, qy, qz, qw of a trajectory, in seconds and metres.
Rows8 rows_of(const Trajectory& trajectory);

}  // namespace bslam::python
