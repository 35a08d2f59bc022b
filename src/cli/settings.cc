// bslam settings: every setting with its value, meaning and range.
#include <cstdio>
#include <memory>

#include "base/option_table.h"
#include "cli/config_arguments.h"
#include "cli/verbs.h"
#include "yaml/config_file.h"

namespace bslam::cli {
namespace {

int print_settings(const ConfigArguments& arguments) {
  auto config = resolve_config(arguments);
  if (!config) return report_error(config.error());
  std::fputs(yaml::config_to_yaml(OptionTable(*config)).c_str(), stdout);
  return kExitOk;
}

}  // namespace

void add_settings(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<ConfigArguments>();
  CLI::App* verb = app.add_subcommand(
      "settings", "every setting with its value (of --config and --set, else its default), meaning and range");
  add_config_options(*verb, *a);
  verb->callback([a, &exit_status] { exit_status = print_settings(*a); });
}

}  // namespace bslam::cli
