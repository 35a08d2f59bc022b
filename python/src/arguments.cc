#include "arguments.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

namespace bslam::python {
namespace {

namespace nb = nanobind;

std::string array_text(nb::handle object, const nb::ndarray<nb::ro>& array) {
  std::string out = "array";
  const nb::object type = nb::getattr(object, "dtype", nb::none());
  if (!type.is_none()) out += " of " + nb::cast<std::string>(nb::str(nb::handle(type)));
  out += ", shape (";
  for (std::size_t i = 0; i < array.ndim(); ++i) out += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return out + ")";
}

}  // namespace

std::string description_of(nb::handle object) {
  constexpr std::size_t kMaxLength = 60;
  if (object.is_none()) return "None";
  nb::ndarray<nb::ro> array;
  if (nb::try_cast(object, array, false)) return array_text(object, array);
  const std::string type = nb::cast<std::string>(object.type().attr("__name__"));
  const bool is_text = PyUnicode_Check(object.ptr()) != 0;
  if (is_text || PyNumber_Check(object.ptr()) != 0) {
    const std::string value = nb::cast<std::string>(nb::repr(object));
    return value.size() <= kMaxLength ? type + " " + value : type;
  }
  if (PySequence_Check(object.ptr()) != 0) return type + " of " + std::to_string(nb::len(object));
  return type;
}

void check_sequence(nb::handle object, const std::string& call, const std::string& key, const std::string& expected) {
  const bool is_text = PyUnicode_Check(object.ptr()) != 0 || PyBytes_Check(object.ptr()) != 0;
  if (is_text || PySequence_Check(object.ptr()) == 0) raise({call, key, description_of(object), expected});
}

}  // namespace bslam::python
