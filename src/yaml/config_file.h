// Reads settings from YAML files and from the command line into a table of options (base/option_table.h), and writes
// them as YAML.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/option_table.h"
#include "base/result.h"

namespace bslam::yaml {

// Applies a YAML file of nested maps, dotted keys, or both. Settings that are not in the file keep their values.
// Former names of settings are accepted, with a warning in the table. Errors name the file and the key: a file that is
// not YAML, an unknown key (with a suggestion if one is close), a repeated key, a bad value. On error, the settings
// before the faulty one may have been applied.
Status apply_config_file(OptionTable& table, const std::filesystem::path& file);

// Applies one "key=value" of the command line; Error.file is "--set".
Status apply_setting(OptionTable& table, std::string_view assignment);

enum class Selection { kAll, kCommon };

// Returns the settings as YAML, each with its value and a comment that gives its meaning, unit and accepted values. The
// comment of an advanced setting begins with "[advanced]". Reading the text back gives exactly the same values.
std::string config_to_yaml(const OptionTable& table, Selection selection = Selection::kAll);

}  // namespace bslam::yaml
