// The Python module bslam._bslam. Its names are made public by bslam/__init__.py.
#include <bslam/system.h>
#include <nanobind/nanobind.h>

#include <array>
#include <exception>
#include <string>
#include <string_view>

#include "bindings.h"
#include "errors.h"

namespace bslam::python {

void raise(Error error) {
  constexpr std::array kClasses = {"Rig", "System", "MapView", "Config"};
  for (const std::string name : kClasses) {
    const std::string prefix = name + "::";
    if (error.file.rfind(prefix, 0) != 0) continue;
    if (name == "Config") error.file = "settings";
    if (name == "MapView") error.file = "Map." + error.file.substr(prefix.size());
    if (name == "Rig" || name == "System") error.file = name + "." + error.file.substr(prefix.size());
  }
  throw Failure(error.message());
}

}  // namespace bslam::python

namespace {

// Names of files in a message need not be UTF-8, which texts of Python are.
void set_error(const std::exception_ptr& exception, void* type) {
  try {
    std::rethrow_exception(exception);
  } catch (const bslam::python::Failure& failure) {
    const std::string_view text = failure.what();
    const auto message =
        nanobind::steal(PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "backslashreplace"));
    if (message.is_valid()) PyErr_SetObject(static_cast<PyObject*>(type), message.ptr());
  }
}

}  // namespace

NB_MODULE(_bslam, module) {
  namespace nb = nanobind;
  using namespace bslam::python;
  nb::exception<Failure> error(module, "Error", PyExc_ValueError);
  nb::register_exception_translator(set_error, error.ptr());
  error.attr("__doc__") =
      "An error in the input: a file, image, setting or call. The text is one line, the same as that of the program: "
      "the location, what was found there and what was expected.";
  module.attr("version") = nb::str(bslam::version().data(), bslam::version().size());
  bind_rig(module);
  bind_frame(module);
  bind_map(module);
  bind_settings(module);
  bind_system(module);
  bind_evaluation(module);
}
