#include "yaml/config_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "base/atomic_file.h"
#include "yaml/yaml_map.h"

namespace bslam::yaml {
namespace {

constexpr std::size_t kMaxConfigBytes = std::size_t{1} << 22;
constexpr int kMaxDepth = 16;  // also bounds the recursion for a file with cyclic aliases

Error with_file(Error error, std::string file) {
  error.file = std::move(file);
  return error;
}

class ConfigReader {
 public:
  ConfigReader(OptionTable& table, std::string file) : table_(table), file_(std::move(file)) {}

  Status apply(const YAML::Node& map, const std::string& prefix, int depth) {
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) return Error{file_, prefix, describe(entry.first), "the name of a setting"};
      const std::string key = prefix + entry.first.Scalar();
      const YAML::Node& value = entry.second;
      const Status status = value.IsMap() ? apply_section(value, key, depth) : apply_value(value, key);
      if (!status) return status;
    }
    return {};
  }

 private:
  Status apply_section(const YAML::Node& map, const std::string& key, int depth) {
    if (depth == kMaxDepth) return Error{file_, key, "maps nested too deeply", "settings"};
    if (const Option* option = table_.find(key)) return Error{file_, key, "a map", expected_text(*option)};
    return apply(map, key + ".", depth + 1);
  }

  Status apply_value(const YAML::Node& value, const std::string& key) {
    const Option* option = table_.find(key);
    if (!seen_.insert(option != nullptr ? option->key : key).second)
      return Error{file_, key, "a repeated key", "a unique key"};
    if (option == nullptr && is_section(key)) {
      if (value.IsNull()) return {};  // a section whose entries are all commented out
      return Error{file_, key, describe(value), "a map of settings"};
    }
    if (option != nullptr && !value.IsScalar()) return Error{file_, key, describe(value), expected_text(*option)};
    const Status status = table_.set(key, value.IsScalar() ? value.Scalar() : "");
    return status ? status : with_file(status.error(), file_);
  }

  bool is_section(const std::string& key) const {
    return std::any_of(table_.options().begin(), table_.options().end(),
                       [&](const Option& option) { return option.key.starts_with(key + "."); });
  }

  OptionTable& table_;
  std::string file_;
  std::set<std::string> seen_;
};

std::vector<std::string_view> split_key(std::string_view key) {
  std::vector<std::string_view> parts;
  for (std::size_t dot = key.find('.'); dot != std::string_view::npos; dot = key.find('.')) {
    parts.push_back(key.substr(0, dot));
    key.remove_prefix(dot + 1);
  }
  parts.push_back(key);
  return parts;
}

std::string comment(const Option& option) {
  std::string text;
  for (const std::string& part : {option.help, option.unit, expected_text(option)}) {
    if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
  }
  return std::string("  # ") + (option.common ? "" : "[advanced] ") + text;
}

}  // namespace

Status apply_config_file(OptionTable& table, const std::filesystem::path& file) {
  auto text = read_file(file, kMaxConfigBytes);
  if (!text) return text.error();
  const auto root = YamlMap::parse(file, *std::move(text));
  if (!root) return root.error();
  return ConfigReader(table, file.string()).apply(root->node(), "", 0);
}

Status apply_setting(OptionTable& table, std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    return Error{"--set", "", std::string(assignment), "key=value"};
  }
  const Status status = table.set(assignment.substr(0, equals), assignment.substr(equals + 1));
  return status ? status : with_file(status.error(), "--set");
}

std::string config_to_yaml(const OptionTable& table, Selection selection) {
  std::string yaml;
  std::vector<std::string_view> open;  // the enclosing sections of the last line
  for (const Option& option : table.options()) {
    if (selection == Selection::kCommon && !option.common) continue;
    std::vector<std::string_view> parts = split_key(option.key);
    const std::string_view name = parts.back();
    parts.pop_back();
    const auto common = static_cast<std::size_t>(
        std::mismatch(open.begin(), open.end(), parts.begin(), parts.end()).first - open.begin());
    for (std::size_t i = common; i < parts.size(); ++i) yaml += fmt::format("{:{}}{}:\n", "", 2 * i, parts[i]);
    const bool is_text = std::holds_alternative<std::string*>(option.field);
    const std::string value = is_text ? yaml_quoted(value_text(option)) : value_text(option);
    yaml += fmt::format("{:{}}{}: {}{}\n", "", 2 * parts.size(), name, value, comment(option));
    open = std::move(parts);
  }
  return yaml;
}

}  // namespace bslam::yaml
