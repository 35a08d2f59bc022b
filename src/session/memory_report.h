// Memory of each part of a run at its end, computed from the sizes of its containers.
#pragma once

#include "evaluation/trajectory.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

struct MemorySources {
  const system::System& system;  // after its end
  const place::Vocabulary* vocabulary = nullptr;
  const RunRecord& record;
  const execution::Journal& journal;
  std::vector<const std::vector<system::SubmapTrajectory>*> trajectories;
  std::size_t read_ahead_bytes = 0;  // maximum memory of the images read in advance
};

MemoryReport memory_report(const MemorySources& sources);

// Adds the largest size of a part that is only held temporarily.
void add_largest(MemoryReport& report, std::string part, std::size_t bytes);

// Returns the report as a text table. Its last lines are the memory that belongs to none of the parts, and the memory
// of the process.
std::string memory_text(const RunRecord& record);

}  // namespace bslam::session
