// The order in which the map was read and changed: enough to run the same stages on the same versions again.
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
  kFrame,  // a frame began; base = the version it sees
  kStart,  // the frame started a map
  kTrack,  // the frame became a keyframe
  kMap,    // a background stage ended
  kLoop,
  kGlobal,
  kFinal,    // the adjustment at the end
  kRestart,  // the map was left for an empty one
};

JournalStep journal_step(Stage stage);
std::optional<Stage> background_stage(JournalStep step);  // of kMap, kLoop and kGlobal

struct JournalEntry {
  JournalStep step = JournalStep::kFrame;
  std::int32_t input = -1;              // keyframe of a background stage, else frame; -1: before the first frame
  MapVersion base;                      // version it worked on
  std::optional<MapVersion> committed;  // version it made, if any
  friend bool operator==(const JournalEntry&, const JournalEntry&) = default;
};

// "map 7": step and input.
std::string step_text(JournalStep step, std::int32_t input);

// "map 7 12 14": step, input, base and committed version, "-" for none.
std::string entry_text(const JournalEntry& entry);

// Entries in order of their commits; a frame's comes after the commits of all versions it may see. Stages whose result
// was discarded are not in it.
struct Journal {
  std::string name;  // of the file it was read from, for messages
  std::vector<JournalEntry> entries;
};

// "bslam-journal 1", then a line per entry: its number from 0 and the entry's text.
std::string journal_text(const Journal& journal);

// Errors, with the line: no journal or another version of it; a line that is no entry; a number or a frame out of turn;
// a committed version that is not the one after the last; a base that did not exist yet; a step that must commit and
// did not, or must not and did.
Result<Journal> parse_journal(std::string_view text, std::string name);

}  // namespace bslam::execution
