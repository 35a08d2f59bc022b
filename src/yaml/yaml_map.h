// Reading YAML with errors that name the file and the key. Internal to io: yaml-cpp stays out of other headers.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bslam::yaml {

// One map of a YAML document and the place where it stands. Getters answer an Error for a missing key, another type,
// and numbers that are not finite.
class YamlMap {
 public:
  // Parses a document whose root is a map (an empty one counts as such). A first line `%YAML:1.0`, as OpenCV and EuRoC
  // write it, is not YAML and is left out. Syntax errors carry the line.
  static Result<YamlMap> parse(const std::filesystem::path& file, std::string text);

  // Present and not null.
  bool has(std::string_view key) const;
  // Refuses keys other than these, naming the nearest one, and repeated ones.
  Status allow_only(const std::vector<std::string>& known) const;

  Result<double> number(std::string_view key) const;
  Result<std::int64_t> integer(std::string_view key) const;
  Result<std::string> text(std::string_view key) const;
  Result<std::vector<double>> numbers(std::string_view key) const;  // a list
  Result<std::vector<double>> rows(std::string_view key,
                                   int size) const;  // a list of `size` lists of `size`, row-major
  Result<YamlMap> map(std::string_view key) const;
  Result<std::vector<YamlMap>> maps(std::string_view key) const;  // a list of maps, at least one

  // For a key of this map; an empty key stands for the map itself.
  Error error(std::string_view key, std::string found, std::string expected) const;
  std::string key_path(std::string_view key) const;

  const YAML::Node& node() const { return node_; }
  const std::string& file() const { return file_; }

 private:
  YamlMap(std::string file, std::string prefix, YAML::Node node)
      : file_(std::move(file)), prefix_(std::move(prefix)), node_(std::move(node)) {}
  YAML::Node at(std::string_view key) const;
  Result<std::vector<double>> number_list(const YAML::Node& list, const std::string& key) const;

  std::string file_, prefix_;  // the prefix is empty or ends in a dot
  YAML::Node node_;
};

// What a node is, in a few words, for the `found` of an Error.
std::string describe(const YAML::Node& node);

// Text as a double-quoted YAML scalar.
std::string yaml_quoted(std::string_view text);

}  // namespace bslam::yaml
