// Errors of bslam as Python exceptions.
#pragma once

#include <bslam/result.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace bslam::python {

// Becomes the Python exception bslam.Error with the one-line message of an Error.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Throws Failure. Names of C++ functions in the message become those of Python, such as System.process.
[[noreturn]] void raise(Error error);

// Returns the value, or throws Failure.
template <class T>
T value_of(Result<T> result) {
  if (!result) raise(result.error());
  return *std::move(result);
}

inline void check(const Status& status) {
  if (!status) raise(status.error());
}

}  // namespace bslam::python
