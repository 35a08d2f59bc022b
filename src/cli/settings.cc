// bslam settings: prints the settings with their values, meanings and ranges.
#include <cstdio>
#include <memory>

#include "base/option_table.h"
#include "cli/config_arguments.h"
#include "cli/verbs.h"
#include "yaml/config_file.h"

namespace bslam::cli {
namespace {

struct SettingsArguments {
  ConfigArguments config;
  bool common = false;
};

int print_settings(const SettingsArguments& arguments) {
  auto config = resolve_config(arguments.config);
  if (!config) return report_error(config.error());
  const auto selection = arguments.common ? yaml::Selection::kCommon : yaml::Selection::kAll;
  std::fputs(yaml::config_to_yaml(OptionTable(*config), selection).c_str(), stdout);
  return kExitOk;
}

}  // namespace

void add_settings(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<SettingsArguments>();
  CLI::App* verb = app.add_subcommand("settings",
                                      "print the settings as YAML, each with its value, meaning and range; settings "
                                      "marked [advanced] are not meant to be "
                                      "changed and may change in any release");
  verb->add_flag("--common", a->common, "print only the settings that are commonly changed, without the advanced ones");
  add_config_options(*verb, a->config);
  verb->callback([a, &exit_status] { exit_status = print_settings(*a); });
}

}  // namespace bslam::cli
