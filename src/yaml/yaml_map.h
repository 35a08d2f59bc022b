// Reads YAML with errors that name the file and the key. This is the only header that includes yaml-cpp.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bslam::yaml {

// One map of a YAML document and its path in the document. Getters return an Error for missing keys, values of another
// type, and numbers that are not finite.
class YamlMap {
 public:
  // Parses `text`, a document that is empty or whose root is a map. `file` is its name in errors and is not read. A
  // first line `%YAML:1.0`, which OpenCV and EuRoC write although it is not valid YAML, is ignored. Syntax errors name
  // the line. A repeated key is an error in this map and in those that map() and maps() return.
  static Result<YamlMap> parse(const std::filesystem::path& file, std::string text);

  // Returns true if the key is present and its value is not null.
  bool has(std::string_view key) const;
  // Errors: a key that is not in `known`, with a suggestion if one is close.
  Status allow_only(const std::vector<std::string>& known) const;

  Result<double> number(std::string_view key) const;
  Result<std::int64_t> integer(std::string_view key) const;
  Result<std::string> text(std::string_view key) const;
  Result<std::vector<double>> numbers(std::string_view key) const;  // a list
  Result<std::vector<double>> rows(std::string_view key,
                                   int size) const;  // a list of `size` lists of `size`, row-major
  Result<YamlMap> map(std::string_view key) const;
  Result<std::vector<YamlMap>> maps(std::string_view key) const;  // a list of maps, at least one

  // Returns an Error at a key of this map. An empty key refers to the map itself.
  Error error(std::string_view key, std::string found, std::string expected) const;
  std::string key_path(std::string_view key) const;

  const YAML::Node& node() const { return node_; }
  const std::string& file() const { return file_; }

 private:
  YamlMap(std::string file, std::string prefix, YAML::Node node)
      : file_(std::move(file)), prefix_(std::move(prefix)), node_(std::move(node)) {}
  static Result<YamlMap> with_unique_keys(YamlMap map);
  YAML::Node at(std::string_view key) const;
  Result<std::vector<double>> number_list(const YAML::Node& list, const std::string& key) const;

  std::string file_, prefix_;  // the prefix is empty or ends with a dot
  YAML::Node node_;
};

// Returns a short description of a node, for the `found` of an Error.
std::string describe(const YAML::Node& node);

// Returns the text as a double-quoted YAML scalar.
std::string yaml_quoted(std::string_view text);

}  // namespace bslam::yaml
