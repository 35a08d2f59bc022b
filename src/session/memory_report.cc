#include "session/memory_report.h"

#include <fmt/format.h>

#include "base/memory_count.h"
#include "report/text_table.h"
#include "session/process_use.h"

namespace bslam::session {
namespace {

constexpr double kBytesPerMb = 1024.0 * 1024.0;

std::size_t bytes_of(const tracking::TrackResult& result) { return memory_bytes(result.cameras); }

std::size_t bytes_of(const RunRecord& record) {
  std::size_t bytes = memory_bytes(record.frames);
  for (const RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    const tracking::FrameRecord& r = *frame.record;
    bytes += bytes_of(r.result) + memory_bytes(r.images) + memory_bytes(r.cameras) + memory_bytes(r.stages);
    if (r.found_later) bytes += sizeof(tracking::TrackResult) + bytes_of(*r.found_later);
  }
  for (const StageSeries& stage : record.stages) bytes += memory_bytes(stage.samples);
  for (const CameraRecord& camera : record.cameras) bytes += memory_bytes(camera.states);
  return bytes;
}

std::string mb_text(double mb) { return fmt::format("{:.2f}", mb); }

}  // namespace

MemoryReport memory_report(const MemorySources& sources) {
  MemoryReport report;
  report.resident_mb = resident_memory_mb();
  const auto add = [&report](std::string part, std::size_t bytes) {
    report.parts.push_back({std::move(part), static_cast<double>(bytes) / kBytesPerMb, {}});
  };
  const system::SystemMemory memory = sources.system.memory();
  add("map: keyframes", memory.map.keyframes);
  add("map: features", memory.map.features);
  add("map: descriptors", memory.map.descriptors);
  add("map: patches", memory.map.patches);
  add("map: visual words", memory.map.words);
  add("map: landmarks", memory.map.landmarks);
  add("map: observations", memory.map.observations);
  add("map: covisibility", memory.map.covisibility);
  add("place index", memory.place_index);
  add("vocabulary", sources.vocabulary ? sources.vocabulary->memory_bytes() : 0);
  add("pyramids", memory.pyramids);
  add_largest(report, "images read ahead", sources.read_ahead_bytes);
  std::size_t poses = 0;
  for (const auto* submaps : sources.trajectories) {
    for (const system::SubmapTrajectory& submap : *submaps) poses += memory_bytes(submap.poses);
  }
  add("trajectories", poses);
  add("run record", bytes_of(sources.record) + memory_bytes(sources.journal.entries));
  return report;
}

void add_largest(MemoryReport& report, std::string part, std::size_t bytes) {
  report.parts.push_back({std::move(part), 0.0, static_cast<double>(bytes) / kBytesPerMb});
}

std::string memory_text(const RunRecord& record) {
  report::Table table{"memory at the end of the run", {"part", "MB", "largest MB"}, {}};
  for (const MemoryPart& part : record.memory.parts)
    table.rows.push_back({part.name, mb_text(part.mb), part.largest_mb ? mb_text(*part.largest_mb) : ""});
  if (const auto resident = record.memory.resident_mb) {
    table.rows.push_back({"rest: program, libraries, heap", mb_text(*resident - record.memory.sum_mb()), ""});
    table.rows.push_back({"process", mb_text(*resident), record.peak_memory_mb ? mb_text(*record.peak_memory_mb) : ""});
  }
  return report::text_table(table);
}

}  // namespace bslam::session
