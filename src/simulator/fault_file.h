// Reads the faults of a simulated recording from a file.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "simulator/faults.h"

namespace bslam::simulator {

// Reads a YAML or JSON list of `{type: NAME, cameras: [..], from: s, to: s}`, NAME being one of fault_names(), with
// `delay_s` if the type is delayed. Errors name the file and the key: a file that cannot be read or is not a list, an
// unknown type or key, cameras that are not integers in [0, num_cameras), an empty or negative interval, a negative
// delay.
Result<std::vector<Fault>> read_faults(const std::filesystem::path& file, std::size_t num_cameras);

}  // namespace bslam::simulator
