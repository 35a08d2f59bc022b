// Errors as values: functions that can fail return a Result or a Status. None of them throws, prints or exits because
// of invalid input.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "bslam/export.h"

namespace bslam {

// An error in the input: its location, what was found there, and what was expected.
struct BSLAM_EXPORT Error {
  std::string file;      // file, folder, function or command-line option; may be empty
  std::string key;       // key, line or section in it; may be empty
  std::string found;     // actual content
  std::string expected;  // accepted content
  // Message that replaces "found X, expected Y"; may be empty.
  std::string sentence = {};

  // One line: "FILE: KEY: found X, expected Y", or "FILE: KEY: SENTENCE". Empty fields are omitted, and so are file
  // and key if the sentence contains them. Control characters are replaced by spaces.
  std::string message() const;
};

// Prints `message` to stderr and aborts. Called only if the absent alternative of a Result is accessed.
[[noreturn]] BSLAM_EXPORT void bad_result_access(const char* message);

// A value or an Error. Check ok() first: accessing the absent alternative is a bug of the caller and aborts.
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
    if (ok()) bad_result_access("error() of a Result that holds a value");
    return std::get<1>(state_);
  }

 private:
  void check() const {
    if (!ok()) bad_result_access("value() of a Result that holds an error");
  }
  std::variant<T, Error> state_;
};

// Success or an Error, for functions without a value.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT: implicit on purpose

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    if (ok()) bad_result_access("error() of a Status that is ok");
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace bslam
