// Records the order in which the map was read and changed, so that a run can be repeated with the same versions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/id.h"
#include "base/result.h"
#include "execution/stage.h"

namespace bslam::execution {

enum class JournalStep {
  kFrame,     // a frame began; base: the version it uses
  kStart,     // the frame initialised a map, or corrected the rig before
  kTrack,     // the frame became a keyframe
  kKeyframe,  // a background stage ended
  kMap,
  kLoop,
  kGlobal,
  kCalibrate,
  kFinal,    // the adjustment at the end
  kRestart,  // the map was replaced by an empty one
  kReduce,   // the level of reduced work changed; input: the new level
};

JournalStep journal_step(Stage stage);
std::optional<Stage> background_stage(JournalStep step);  // nullopt if it is not one of a background stage

struct JournalEntry {
  JournalStep step = JournalStep::kFrame;
  // StageTask::input() of a background stage, level of kReduce, else id of the frame; -1: no frame yet.
  std::int32_t input = -1;
  MapVersion base;                      // version that was read
  std::optional<MapVersion> committed;  // version that was created, if any
  friend bool operator==(const JournalEntry&, const JournalEntry&) = default;
};

// "map 7": step and input.
std::string step_text(JournalStep step, std::int32_t input);

// "map 7 12 14": step, input, base and committed version, "-" for none.
std::string entry_text(const JournalEntry& entry);

// Entries in order of their commits. The entry of a frame follows the commits of all versions that it may use. Stages
// whose result was discarded have no entry.
struct Journal {
  std::string name;  // name of its file, for messages
  std::vector<JournalEntry> entries;
};

// "bslam-journal 1", then one line per entry: its number from 0 and the entry's text.
std::string journal_text(const Journal& journal);

// Errors, with the line: not a journal, or another version of the format; an invalid entry; a number or frame that is
// not in order; a committed version that does not follow the last one; a base that did not exist yet; a missing or
// unexpected commit of a step.
Result<Journal> parse_journal(std::string_view text, std::string name);

}  // namespace bslam::execution
