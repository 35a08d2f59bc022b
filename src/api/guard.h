// Nothing is thrown across the public interface.
#pragma once

#include <exception>
#include <string>

#include "base/result.h"

namespace bslam::api {

// What `call` returns, a Result or Status; or what it threw, as an Error of the public function `name`.
template <class Call>
auto guarded(const char* name, Call&& call) -> decltype(call()) {
  try {
    return call();
  } catch (const std::exception& exception) {
    return Error{name, "", std::string("the exception ") + exception.what(), "none"};
  } catch (...) {
    return Error{name, "", "an exception of unknown kind", "none"};
  }
}

}  // namespace bslam::api
