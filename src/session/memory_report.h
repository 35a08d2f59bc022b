// Which parts of a run hold how much memory at its end, computed from the sizes of their containers.
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
  std::size_t read_ahead_bytes = 0;  // most that images which were read in advance have held
};

MemoryReport memory_report(const MemorySources& sources);

// Adds a part that is held for a moment only: its largest size.
void add_largest(MemoryReport& report, std::string part, std::size_t bytes);

// Returns the report as a table of text, with what none of the parts holds and the memory of the process at the end.
std::string memory_text(const RunRecord& record);

}  // namespace bslam::session
