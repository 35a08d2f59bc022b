// Arguments of Python functions. Those of a wrong type are errors in one line, like all others.
#pragma once

#include <nanobind/nanobind.h>

#include <optional>
#include <string>
#include <utility>

#include "errors.h"

namespace bslam::python {

// Names the type of an object, with the value of short texts and numbers, the length of lists, and the type and shape
// of arrays: "str 'rig.yaml'", "list of 3", "array of float32, shape (3, 3)".
std::string description_of(nanobind::handle object);

// Converts an argument. Throws Failure with what was found if that is not possible. `call` and `key` name it.
template <class T>
T argument(nanobind::handle object, const std::string& call, const std::string& key, const std::string& expected) {
  T out;
  if (object.is_none() || !nanobind::try_cast(object, out)) raise({call, key, description_of(object), expected});
  return out;
}

// The same for an argument that may be None.
template <class T>
std::optional<T> optional_argument(nanobind::handle object, const std::string& call, const std::string& key,
                                   const std::string& expected) {
  if (object.is_none()) return std::nullopt;
  return argument<T>(object, call, key, expected);
}

// Throws Failure unless the object is a list or another sequence, but no text.
void check_sequence(nanobind::handle object, const std::string& call, const std::string& key,
                    const std::string& expected);

}  // namespace bslam::python
