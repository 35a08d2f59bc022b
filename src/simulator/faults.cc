#include "simulator/faults.h"

#include <array>
#include <utility>

namespace bslam::simulator {
namespace {

constexpr std::array<std::pair<FaultType, std::string_view>, 6> kNames = {{
    {FaultType::kBlack, "black"},
    {FaultType::kFrozen, "frozen"},
    {FaultType::kOverExposed, "over_exposed"},
    {FaultType::kDropped, "dropped"},
    {FaultType::kDelayed, "delayed"},
    {FaultType::kBlurred, "blurred"},
}};

}  // namespace

std::string_view fault_name(FaultType type) { return kNames[static_cast<std::size_t>(type)].second; }

std::optional<FaultType> fault_type(std::string_view name) {
  for (const auto& [type, known] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

}  // namespace bslam::simulator
