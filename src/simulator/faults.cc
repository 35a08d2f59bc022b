#include "simulator/faults.h"

#include <array>
#include <utility>

namespace bslam::simulator {
namespace {

constexpr std::array<std::pair<FaultType, std::string_view>, 6> kNames = {{
    {FaultType::kBlack, "black"},
    {FaultType::kFrozen, "frozen"},
    {FaultType::kOverExposed, "over_exposed"},
    {FaultType::kBlurred, "blurred"},
    {FaultType::kDropped, "dropped"},
    {FaultType::kDelayed, "delayed"},
}};

}  // namespace

std::string_view fault_name(FaultType type) { return kNames[static_cast<std::size_t>(type)].second; }

std::string fault_names() {
  std::string out;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (i > 0) out += i + 1 < kNames.size() ? ", " : " or ";
    out += kNames[i].second;
  }
  return out;
}

std::optional<FaultType> fault_type(std::string_view name) {
  for (const auto& [type, known] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

}  // namespace bslam::simulator
