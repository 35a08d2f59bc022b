#include "simulator/fault_file.h"

#include <fmt/format.h>

#include <cmath>

#include "base/atomic_file.h"
#include "yaml/yaml_map.h"

namespace bslam::simulator {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

// Wraps the list in a map with one key, since YamlMap reads maps.
Result<yaml::YamlMap> parse_list(const std::filesystem::path& file, const std::string& text) {
  try {
    const YAML::Node list = YAML::Load(text);
    if (!list.IsSequence()) return Error{file.string(), "", yaml::describe(list), "a list of faults"};
    YAML::Node root;
    root["faults"] = list;
    return yaml::YamlMap::parse(file, YAML::Dump(root));
  } catch (const YAML::Exception& e) {
    return Error{file.string(), fmt::format("line {}", e.mark.line + 1), e.msg, "YAML or JSON"};
  }
}

Status read_cameras(const yaml::YamlMap& map, std::size_t num_cameras, Fault& fault) {
  const auto cameras = map.numbers("cameras");
  if (!cameras) return cameras.error();
  if (cameras->empty()) return map.error("cameras", "none", "at least one camera");
  for (const double camera : *cameras) {
    if (camera < 0 || camera >= static_cast<double>(num_cameras) || camera != std::floor(camera)) {
      return map.error("cameras", fmt::format("{}", camera), fmt::format("cameras from 0 to {}", num_cameras - 1));
    }
    fault.cameras.push_back(static_cast<int>(camera));
  }
  return {};
}

Result<Fault> read_fault(const yaml::YamlMap& map, std::size_t num_cameras) {
  if (const Status s = map.allow_only({"type", "cameras", "from", "to", "delay_s"}); !s) return s.error();
  const auto name = map.text("type");
  if (!name) return name.error();
  const auto type = fault_type(*name);
  if (!type) return map.error("type", *name, fault_names());
  Fault fault;
  fault.type = *type;
  if (const Status s = read_cameras(map, num_cameras, fault); !s) return s.error();
  const auto from = map.number("from"), to = map.number("to");
  if (!from) return from.error();
  if (!to) return to.error();
  if (!(*from >= 0)) return map.error("from", fmt::format("{}", *from), "a non-negative number of seconds");
  if (!(*to > *from)) return map.error("to", fmt::format("{}", *to), fmt::format("more than {} s", *from));
  fault.from_s = *from;
  fault.to_s = *to;
  if (map.has("delay_s")) {
    const auto delay = map.number("delay_s");
    if (!delay) return delay.error();
    if (*type != FaultType::kDelayed)
      return map.error("delay_s", fmt::format("a delay for type {}", *name), "delay_s with type delayed only");
    if (!(*delay >= 0)) return map.error("delay_s", fmt::format("{}", *delay), "a non-negative number of seconds");
    fault.delay_s = *delay;
  }
  return fault;
}

}  // namespace

Result<std::vector<Fault>> read_faults(const std::filesystem::path& file, std::size_t num_cameras) {
  const auto text = read_file(file, kMaxBytes);
  if (!text) return text.error();
  const auto root = parse_list(file, *text);
  if (!root) return root.error();
  if (root->node()["faults"].size() == 0) return std::vector<Fault>();
  const auto maps = root->maps("faults");
  if (!maps) return maps.error();
  std::vector<Fault> faults;
  for (const yaml::YamlMap& map : *maps) {
    const auto fault = read_fault(map, num_cameras);
    if (!fault) return fault.error();
    faults.push_back(*fault);
  }
  return faults;
}

}  // namespace bslam::simulator
