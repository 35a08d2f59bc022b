#include "yaml/yaml_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "base/nearest_name.h"
#include "base/number_text.h"

namespace bslam::yaml {

Result<YamlMap> YamlMap::parse(const std::filesystem::path& file, std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // byte order mark
  if (text.starts_with("%YAML:")) text[0] = '#';           // becomes a comment, so that line numbers stay the same
  try {
    YAML::Node root = YAML::Load(text);
    if (!root.IsDefined() || root.IsNull()) root = YAML::Node(YAML::NodeType::Map);
    if (!root.IsMap()) return Error{file.string(), "", describe(root), "a YAML map"};
    return with_unique_keys(YamlMap(file.string(), "", root));
  } catch (const YAML::Exception& e) {
    const std::string line = e.mark.is_null() ? "" : fmt::format("line {}", e.mark.line + 1);
    return Error{file.string(), line, "invalid YAML (" + e.msg + ")", "YAML"};
  }
}

YAML::Node YamlMap::at(std::string_view key) const {
  const YAML::Node& node = node_;  // const, since otherwise yaml-cpp would add a missing key
  return node[std::string(key)];
}

bool YamlMap::has(std::string_view key) const {
  const YAML::Node node = at(key);
  return node.IsDefined() && !node.IsNull();
}

Result<YamlMap> YamlMap::with_unique_keys(YamlMap map) {
  std::set<std::string> seen;
  for (const auto& entry : map.node_) {
    if (entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
      return map.error(entry.first.Scalar(), "a repeated key", "a unique key");
  }
  return map;
}

Status YamlMap::allow_only(const std::vector<std::string>& known) const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : describe(entry.first);
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      Error unknown = error(key, "an unknown key", "");
      const std::string nearest = nearest_name(key, known);
      unknown.sentence = nearest.empty() ? "unknown key" : "unknown key; did you mean '" + nearest + "'?";
      return unknown;
    }
  }
  return {};
}

Result<double> YamlMap::number(std::string_view key) const {
  const YAML::Node node = at(key);
  const auto value = node.IsDefined() && node.IsScalar() ? parse_double(node.Scalar()) : std::nullopt;
  if (!value) return error(key, describe(node), "a finite number");
  return *value;
}

Result<std::int64_t> YamlMap::integer(std::string_view key) const {
  const YAML::Node node = at(key);
  const auto value = node.IsDefined() && node.IsScalar() ? parse_integer(node.Scalar()) : std::nullopt;
  if (!value) return error(key, describe(node), "an integer");
  return *value;
}

Result<std::string> YamlMap::text(std::string_view key) const {
  const YAML::Node node = at(key);
  if (!node.IsDefined() || !node.IsScalar() || node.Scalar().empty())
    return error(key, describe(node), "text that is not empty");
  return node.Scalar();
}

Result<std::vector<double>> YamlMap::number_list(const YAML::Node& list, const std::string& key) const {
  std::vector<double> numbers;
  for (const YAML::Node& entry : list) {
    const auto value = entry.IsScalar() ? parse_double(entry.Scalar()) : std::nullopt;
    if (!value) return error(fmt::format("{}[{}]", key, numbers.size()), describe(entry), "a finite number");
    numbers.push_back(*value);
  }
  return numbers;
}

Result<std::vector<double>> YamlMap::numbers(std::string_view key) const {
  const YAML::Node node = at(key);
  if (!node.IsDefined() || !node.IsSequence()) return error(key, describe(node), "a list of numbers");
  return number_list(node, std::string(key));
}

Result<std::vector<double>> YamlMap::rows(std::string_view key, int size) const {
  const YAML::Node node = at(key);
  const std::string expected = fmt::format("{} rows of {} numbers", size, size);
  const auto count = static_cast<std::size_t>(size);
  if (!node.IsDefined() || !node.IsSequence() || node.size() != count) return error(key, describe(node), expected);
  std::vector<double> all;
  for (std::size_t r = 0; r < count; ++r) {
    const YAML::Node row = node[r];
    const std::string row_key = fmt::format("{}[{}]", key, r);
    if (!row.IsSequence() || row.size() != count) return error(row_key, describe(row), fmt::format("{} numbers", size));
    const auto numbers = number_list(row, row_key);
    if (!numbers) return numbers.error();
    all.insert(all.end(), numbers->begin(), numbers->end());
  }
  return all;
}

Result<YamlMap> YamlMap::map(std::string_view key) const {
  const YAML::Node node = at(key);
  if (!node.IsDefined() || !node.IsMap()) return error(key, describe(node), "a map");
  return with_unique_keys(YamlMap(file_, key_path(key) + ".", node));
}

Result<std::vector<YamlMap>> YamlMap::maps(std::string_view key) const {
  const YAML::Node node = at(key);
  if (!node.IsDefined() || !node.IsSequence() || node.size() == 0) {
    return error(key, describe(node), "a list of at least one map");
  }
  std::vector<YamlMap> out;
  for (const YAML::Node& entry : node) {
    const std::string entry_key = fmt::format("{}[{}]", key, out.size());
    if (!entry.IsMap()) return error(entry_key, describe(entry), "a map");
    auto map = with_unique_keys(YamlMap(file_, key_path(entry_key) + ".", entry));
    if (!map) return map.error();
    out.push_back(*std::move(map));
  }
  return out;
}

std::string YamlMap::key_path(std::string_view key) const { return prefix_ + std::string(key); }

Error YamlMap::error(std::string_view key, std::string found, std::string expected) const {
  std::string path = key_path(key);
  if (path.ends_with('.')) path.pop_back();
  return {file_, std::move(path), std::move(found), std::move(expected)};
}

std::string describe(const YAML::Node& node) {
  constexpr std::size_t kShown = 40;
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  if (node.IsMap()) return "a map";
  const std::string& text = node.Scalar();
  if (text.empty()) return "empty text";
  return text.size() <= kShown ? text : text.substr(0, kShown) + "...";
}

std::string yaml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace bslam::yaml
