#include "cli/config_arguments.h"

#include "cli/print_message.h"
#include "yaml/config_file.h"

namespace bslam::cli {

void add_config_options(CLI::App& verb, ConfigArguments& arguments) {
  verb.add_option("--config", arguments.file, "settings in YAML, such as the config.yaml of an earlier run");
  verb.add_option("--set", arguments.settings,
                  "a setting as key=value, which overrides the file; may be repeated; see bslam settings")
      ->expected(1)
      ->take_all();
}

Result<system::Config> resolve_config(const ConfigArguments& arguments, system::Config config) {
  OptionTable table(config);
  if (!arguments.file.empty()) {
    if (const Status s = yaml::apply_config_file(table, arguments.file); !s) return s.error();
  }
  for (const std::string& setting : arguments.settings) {
    if (const Status s = yaml::apply_setting(table, setting); !s) return s.error();
  }
  for (const std::string& warning : table.warnings()) print_message("warning: {}\n", warning);
  return config;
}

}  // namespace bslam::cli
