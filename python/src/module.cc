// The Python module bslam._bslam. Its names are made public by bslam/__init__.py.
#include <bslam/system.h>
#include <nanobind/nanobind.h>

#include <array>

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

NB_MODULE(_bslam, module) {
  namespace nb = nanobind;
  using namespace bslam::python;
  nb::exception<Failure> error(module, "Error", PyExc_ValueError);
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
