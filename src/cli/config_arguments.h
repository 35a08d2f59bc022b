// The options that change settings, shared by the verbs that run stages.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "system/config.h"

namespace bslam::cli {

struct ConfigArguments {
  std::string file;
  std::vector<std::string> settings;
};

void add_config_options(CLI::App& verb, ConfigArguments& arguments);

// Defaults, then the file, then the single settings. Errors: what io/config_file.h refuses.
Result<system::Config> resolve_config(const ConfigArguments& arguments);

}  // namespace bslam::cli
