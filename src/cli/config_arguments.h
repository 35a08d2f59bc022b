// The command-line options that change settings, shared by the commands that run the SLAM system.
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

// Returns `config`, the defaults of the command, overridden by the file, overridden by single settings. Prints a
// warning for every former name of a setting. Errors: those of yaml/config_file.h.
Result<system::Config> resolve_config(const ConfigArguments& arguments, system::Config config = {});

}  // namespace bslam::cli
