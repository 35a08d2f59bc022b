// One function per part of the module, which adds its classes and functions.
#pragma once

#include <nanobind/nanobind.h>

namespace bslam::python {

void bind_rig(nanobind::module_& module);
void bind_frame(nanobind::module_& module);
void bind_map(nanobind::module_& module);
void bind_system(nanobind::module_& module);
void bind_settings(nanobind::module_& module);
void bind_evaluation(nanobind::module_& module);

}  // namespace bslam::python
