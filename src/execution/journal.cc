#include "execution/journal.h"

#include <array>
#include <limits>

#include "base/number_text.h"
#include "base/work.h"

namespace bslam::execution {
namespace {

constexpr std::string_view kHeader = "bslam-journal 1";
constexpr std::string_view kNone = "-";
constexpr std::size_t kFields = 5;

struct StepName {
  JournalStep step;
  std::string_view name;
};
constexpr StepName kSteps[] = {{JournalStep::kFrame, "frame"},   {JournalStep::kStart, "start"},
                               {JournalStep::kTrack, "track"},   {JournalStep::kKeyframe, "keyframe"},
                               {JournalStep::kMap, "map"},       {JournalStep::kLoop, "loop"},
                               {JournalStep::kGlobal, "global"}, {JournalStep::kCalibrate, "calibrate"},
                               {JournalStep::kFinal, "final"},   {JournalStep::kRestart, "restart"},
                               {JournalStep::kReduce, "reduce"}};

std::string_view step_name(JournalStep step) {
  for (const StepName& s : kSteps) {
    if (s.step == step) return s.name;
  }
  return "";
}

std::optional<JournalStep> step_of(std::string_view name) {
  for (const StepName& s : kSteps) {
    if (s.name == name) return s.step;
  }
  return std::nullopt;
}

std::string id_text(std::int32_t id) { return id < 0 ? std::string(kNone) : std::to_string(id); }

// A number in the range of an id; -1 for "-".
std::optional<std::int32_t> parse_id(std::string_view text) {
  if (text == kNone) return -1;
  const auto number = parse_integer(text);
  if (!number || *number < 0 || *number >= std::numeric_limits<std::int32_t>::max()) return std::nullopt;
  if (std::to_string(*number) != text) return std::nullopt;
  return static_cast<std::int32_t>(*number);
}

// Returns the text up to the separator, and removes both from `rest`.
std::string_view take(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view taken = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return taken;
}

// The entry of a line. Returns nullopt if it is invalid or has another number.
std::optional<JournalEntry> parse_entry(std::string_view line, std::size_t number) {
  std::array<std::string_view, kFields> fields;
  for (std::string_view& field : fields) field = take(line, ' ');
  const auto step = step_of(fields[1]);
  const auto input = parse_id(fields[2]), base = parse_id(fields[3]), committed = parse_id(fields[4]);
  if (!line.empty() || fields[0] != std::to_string(number)) return std::nullopt;
  if (!step || !input || !base || *base < 0 || !committed) return std::nullopt;
  JournalEntry entry{*step, *input, MapVersion(*base), std::nullopt};
  if (*committed >= 0) entry.committed = MapVersion(*committed);
  return entry;
}

// Describes the entry expected after entries that led to version `newest` at frame `frame`. Returns an empty string if
// `entry` is valid.
std::string objection(const JournalEntry& entry, MapVersion newest, std::int32_t frame) {
  if (entry.step == JournalStep::kFrame && entry.input <= frame) return "a frame after " + std::to_string(frame);
  if (entry.input < 0 && entry.step != JournalStep::kFinal) return "the id of a frame or keyframe";
  if (entry.base > newest) return "a base version up to " + std::to_string(newest.value());
  if (entry.committed && *entry.committed != newest.next())
    return "committed version " + std::to_string(newest.next().value());
  const bool edits = entry.step != JournalStep::kFrame && entry.step != JournalStep::kReduce;
  if (entry.step == JournalStep::kReduce && entry.input > kMaxReduction)
    return "a level of reduction up to " + std::to_string(kMaxReduction);
  if (!edits && entry.committed) return "no committed version of this step";
  if (edits && !background_stage(entry.step) && !entry.committed) return "a committed version";
  return {};
}

}  // namespace

JournalStep journal_step(Stage stage) {
  switch (stage) {
    case Stage::kKeyframe:
      return JournalStep::kKeyframe;
    case Stage::kMap:
      return JournalStep::kMap;
    case Stage::kLoop:
      return JournalStep::kLoop;
    case Stage::kGlobal:
      return JournalStep::kGlobal;
    case Stage::kCalibrate:
      return JournalStep::kCalibrate;
  }
  return JournalStep::kMap;
}

std::optional<Stage> background_stage(JournalStep step) {
  for (const Stage stage : kStages) {
    if (journal_step(stage) == step) return stage;
  }
  return std::nullopt;
}

std::string step_text(JournalStep step, std::int32_t input) {
  return std::string(step_name(step)) + ' ' + id_text(input);
}

std::string entry_text(const JournalEntry& entry) {
  const std::int32_t committed = entry.committed ? entry.committed->value() : -1;
  return step_text(entry.step, entry.input) + ' ' + id_text(entry.base.value()) + ' ' + id_text(committed);
}

std::string journal_text(const Journal& journal) {
  std::string text = std::string(kHeader) + '\n';
  for (std::size_t i = 0; i < journal.entries.size(); ++i) {
    text += std::to_string(i) + ' ' + entry_text(journal.entries[i]) + '\n';
  }
  return text;
}

Result<Journal> parse_journal(std::string_view text, std::string name) {
  Journal journal;
  const std::string_view header = take(text, '\n');
  if (header != kHeader) return Error{name, "line 1", std::string(header.substr(0, 40)), std::string(kHeader)};
  MapVersion newest;
  std::int32_t frame = -1;
  while (!text.empty()) {
    const std::string_view line = take(text, '\n');
    const std::size_t number = journal.entries.size();
    const auto entry = parse_entry(line, number);
    const std::string wrong = "line " + std::to_string(number + 2);
    if (!entry) {
      return Error{name, wrong, std::string(line.substr(0, 80)), std::to_string(number) + " STEP INPUT BASE COMMITTED"};
    }
    if (number == 0) newest = entry->base;  // a run may begin with a map
    if (std::string expected = objection(*entry, newest, frame); !expected.empty()) {
      return Error{name, wrong, std::string(line), std::move(expected)};
    }
    if (entry->step == JournalStep::kFrame) frame = entry->input;
    if (entry->committed) newest = *entry->committed;
    journal.entries.push_back(*entry);
  }
  journal.name = std::move(name);
  return journal;
}

}  // namespace bslam::execution
