// Errors as return values: Error describes a problem caused by user input or the environment. It is shown as one line.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "base/assert.h"

namespace bslam {

// One problem with the user's input: where it is, what was found, and what was expected.
struct Error {
  std::string file;      // file, folder or command-line option; may be empty
  std::string key;       // key, line or section within the file; may be empty
  std::string found;     // the actual value
  std::string expected;  // the expected value

  // "FILE: KEY: found X, expected Y" on one line. Empty fields are omitted and control characters are replaced.
  std::string message() const;
};

// Either a value or an Error. Accessing the one that is absent is an assertion failure.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit on purpose
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  const T& value() const& { return check(), std::get<0>(state_); }
  T& value() & { return check(), std::get<0>(state_); }
  T&& value() && { return check(), std::get<0>(std::move(state_)); }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

  const Error& error() const {
    BSLAM_ASSERT(!ok(), "error() of a Result that holds a value");
    return std::get<1>(state_);
  }

 private:
  void check() const { BSLAM_ASSERT(ok(), "value() of a Result that holds an error"); }
  std::variant<T, Error> state_;
};

// Either success or an Error, for functions without a return value.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    BSLAM_ASSERT(!ok(), "error() of a Status that is ok");
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace bslam
