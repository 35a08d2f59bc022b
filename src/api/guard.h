// Converts exceptions to errors: the public interface does not throw.
#pragma once

#include <exception>
#include <string>

#include "base/result.h"

namespace bslam::api {

// The Error of the public function `name` that `call` threw.
inline Error unexpected_exception(const char* name, const char* what) {
  Error error;
  error.file = name;
  error.sentence = std::string("unexpected exception: ") + what;
  return error;
}

// Returns the result of `call`, a Result or Status, or the exception that it threw as an Error of the public function
// `name`.
template <class Call>
auto guarded(const char* name, Call&& call) -> decltype(call()) {
  try {
    return call();
  } catch (const std::exception& exception) {
    return unexpected_exception(name, exception.what());
  } catch (...) {
    return unexpected_exception(name, "unknown type");
  }
}

}  // namespace bslam::api
