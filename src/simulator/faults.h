// What can go wrong with a camera of the simulated rig for a while.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace bslam::simulator {

enum class FaultType {
  kBlack,        // pictures without any light
  kFrozen,       // the last picture before, again and again, under new stamps
  kOverExposed,  // far too much light
  kDropped,      // no pictures
  kDelayed,      // pictures show the world as it was `delay_s` before their stamp
  kBlurred,      // out of focus, as behind a drop or a smeared lens
};

struct Fault {
  FaultType type = FaultType::kBlack;
  std::vector<int> cameras = {};  // positions in the rig
  double from_s = 0, to_s = 0;    // since the first image; from is in, to is out
  double delay_s = 0.1;           // of kDelayed
};

// Names in files: black, frozen, over_exposed, dropped, delayed, blurred.
std::string_view fault_name(FaultType type);
std::optional<FaultType> fault_type(std::string_view name);

}  // namespace bslam::simulator
