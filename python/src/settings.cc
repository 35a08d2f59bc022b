#include "settings.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "errors.h"

namespace bslam::python {
namespace {

namespace nb = nanobind;

// The text of a value as in YAML: true, false, or what Python writes.
std::string text_of(nb::handle value) {
  if (value.is(Py_True)) return "true";
  if (value.is(Py_False)) return "false";
  return nb::cast<std::string>(nb::str(value));
}

}  // namespace

Config make_config(const SettingArguments& a) {
  Config config;
  if (a.config) check(config.load(*a.config));
  if (!a.settings.is_none()) {
    for (const nb::handle item : nb::object(a.settings.attr("items")())) {
      check(config.set(text_of(nb::object(item[0])), text_of(nb::object(item[1]))));
    }
  }
  if (!a.mode.empty()) check(config.set("mode", a.mode));
  if (a.seed) check(config.set_seed(*a.seed));
  if (a.localize_only) check(config.set("localize_only", "true"));
  return config;
}

void bind_settings(nb::module_& module) {
  nb::class_<Setting>(module, "Setting", "Description of one setting.")
      .def_ro("name", &Setting::name, "Such as features.per_image.")
      .def_ro("value", &Setting::value, "The default, as text.")
      .def_ro("expected", &Setting::expected, "Accepted values.")
      .def_ro("unit", &Setting::unit, "Unit of the value; may be empty.")
      .def_ro("help", &Setting::help, "Meaning, one line.")
      .def("__repr__", [](const Setting& s) { return "Setting(" + s.name + " = " + s.value + ")"; });
  module.def(
      "settings", [] { return Config().settings(); }, "Returns all settings with their defaults, ranges and meanings.");
}

}  // namespace bslam::python
