// The faults of a simulated recording, from a file.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "simulator/faults.h"

namespace bslam::simulator {

// Reads a YAML or JSON list of `{type: black|frozen|over_exposed|blurred|dropped|delayed, cameras: [..], from: s, to:
// s}`, with `delay_s` where the type is delayed. Errors name file and key: not readable, no list, unknown type or key,
// cameras that are no whole numbers in [0, num_cameras), an empty or negative interval, a delay below 0.
Result<std::vector<simulator::Fault>> read_faults(const std::filesystem::path& file, std::size_t num_cameras);

}  // namespace bslam::simulator
