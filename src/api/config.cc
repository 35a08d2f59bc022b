#include <bslam/config.h>

#include <utility>

#include "api/config_impl.h"
#include "api/guard.h"
#include "base/option_table.h"
#include "yaml/config_file.h"

namespace bslam {
namespace {

execution::Mode internal(Mode mode) {
  switch (mode) {
    case Mode::kSequential:
      return execution::Mode::kSequential;
    case Mode::kLagged:
      return execution::Mode::kLagged;
    case Mode::kParallel:
      return execution::Mode::kParallel;
  }
  return execution::Mode::kParallel;
}

}  // namespace

Config::Config() : impl_(std::make_unique<Impl>()) {
  impl_->config.execution.await_calibration = false;  // for live use
  impl_->config.execution.await_mapping_s = 0.0;
}
Config::Config(const Config& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
Config& Config::operator=(const Config& other) {
  *impl_ = *other.impl_;
  return *this;
}
Config::~Config() = default;

Status Config::set(std::string_view name, std::string_view value) {
  return api::guarded("Config::set", [&]() -> Status {
    OptionTable table(impl_->config);
    const Status status = table.set(name, value);
    if (status) {
      impl_->keep(table.warnings());
      return status;
    }
    Error error = status.error();
    error.file = "Config::set";
    return error;
  });
}

void Config::set_mode(Mode mode) { impl_->config.mode = internal(mode); }

Status Config::set_seed(int seed) { return set("seed", std::to_string(seed)); }

Status Config::load(const std::filesystem::path& file) {
  return api::guarded("Config::load", [&]() -> Status {
    Impl changed = *impl_;
    OptionTable table(changed.config);
    if (const Status status = yaml::apply_config_file(table, file); !status) return status;
    changed.keep(table.warnings());
    *impl_ = std::move(changed);
    return {};
  });
}

Result<std::string> Config::get(std::string_view name) const {
  return api::guarded("Config::get", [&]() -> Result<std::string> {
    const OptionTable table(impl_->config);
    if (const Option* option = table.find(name)) return value_text(*option);
    return Error{"Config::get", std::string(name), "no such setting", "a name of Config::settings()"};
  });
}

std::vector<Setting> Config::settings() const {
  std::vector<Setting> out;
  const OptionTable table(impl_->config);
  for (const Option& option : table.options()) {
    out.push_back({option.key, value_text(option), expected_text(option), option.unit, option.help});
  }
  return out;
}

std::string Config::to_yaml() const { return yaml::config_to_yaml(OptionTable(impl_->config)); }

}  // namespace bslam
