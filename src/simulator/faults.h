// Temporary faults of cameras of the simulated rig.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bslam::simulator {

enum class FaultType {
  kBlack,        // images without any light
  kFrozen,       // the previous image is repeated with new time stamps
  kOverExposed,  // far too much light
  kBlurred,      // out of focus, as behind a drop of water or a smeared lens
  kDropped,      // no images
  kDelayed,      // images show the world `delay_s` before their time stamps
};

struct Fault {
  FaultType type = FaultType::kBlack;
  std::vector<int> cameras = {};  // indices in the rig
  double from_s = 0, to_s = 0;    // seconds after the first image; the interval includes from_s but not to_s
  double delay_s = 0.1;           // for kDelayed only
};

// The name of a type in files, and a list of all names: "black, frozen, ... or delayed".
std::string_view fault_name(FaultType type);
std::string fault_names();
std::optional<FaultType> fault_type(std::string_view name);

}  // namespace bslam::simulator
