// Settings given as Python values.
#pragma once

#include <bslam/config.h>
#include <nanobind/nanobind.h>

#include <filesystem>
#include <optional>
#include <string>

namespace bslam::python {

// The arguments of System that become settings. Later ones override earlier ones.
struct SettingArguments {
  std::optional<std::filesystem::path> config;
  nanobind::handle settings;  // a mapping from names to values, or None
  std::string mode;
  std::optional<int> seed;
  bool localize_only = false;
};

// Throws Failure: those of Config, an unknown mode.
Config make_config(const SettingArguments& arguments);

}  // namespace bslam::python
