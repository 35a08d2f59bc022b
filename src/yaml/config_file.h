// Settings in YAML and on the command line, for any table of options (base/option_table.h).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/option_table.h"
#include "base/result.h"

namespace bslam::yaml {

// Applies a YAML file of nested maps, dotted keys, or both; what it does not name stays as it is. Errors name file and
// key: no YAML, unknown key (with the nearest known one), a key twice, a bad value. On error some settings may be
// applied.
Status apply_config_file(OptionTable& table, const std::filesystem::path& file);

// Applies one "key=value" of the command line; Error.file is "--set".
Status apply_setting(OptionTable& table, std::string_view assignment);

// Every setting in force as YAML with its meaning beside it; reading it back gives the same values exactly.
std::string config_to_yaml(const OptionTable& table);

}  // namespace bslam::yaml
