#include "cli/bench_runs.h"

#include <fmt/format.h>

#include <cstring>
#include <fstream>

#include "base/atomic_file.h"
#include "cli/verbs.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;

// Returns the error that a run printed: its last line, without the name of the program.
std::string message_in(const fs::path& log) {
  const auto text = read_file(log, kMaxLogBytes);
  if (!text) return text.error().message();
  std::string last = text->substr(0, text->find_last_not_of('\n') + 1);
  last.erase(0, last.find_last_of('\n') + 1);
  constexpr std::string_view kPrefix = "bslam: ";
  return last.starts_with(kPrefix) ? last.substr(kPrefix.size()) : last;
}

}  // namespace

// Returns the options that every run receives as they are.
std::vector<std::string> run_options(const BenchArguments& a) {
  std::vector<std::string> words;
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  if (a.data.format != "auto") add("--format", a.data.format);
  if (a.data.cameras) add("--cameras", *a.data.cameras);
  if (a.data.begin_s) add("--begin", fmt::format("{}", *a.data.begin_s));
  if (a.data.end_s) add("--end", fmt::format("{}", *a.data.end_s));
  add("--topics", a.data.images.topics);
  if (a.data.images.rate_hz) add("--rate", fmt::format("{}", *a.data.images.rate_hz));
  add("--stamp-unit", a.data.images.stamp_unit);
  add("--bayer", a.data.images.bayer);
  add("--masks", a.data.images.masks);
  add("--vignettes", a.data.images.vignettes);
  if (a.data.images.side_by_side) words.emplace_back("--side-by-side");
  add("--config", a.config.file);
  for (const std::string& setting : a.config.settings) add("--set", setting);
  add("--mode", a.mode);
  add("--pace", a.pace);
  add("--late", a.late);
  add("--vocabulary", a.vocabulary);
  if (a.no_loop) words.emplace_back("--no-loop");
  if (a.no_final_ba) words.emplace_back("--no-final-ba");
  return words;
}

std::vector<std::string> run_words(const BenchArguments& a, const std::string& data, const std::string& rig,
                                   const fs::path& folder, int seed) {
  std::vector<std::string> words{"run",        data,    "--out",  folder.string(),     "--overwrite",
                                 "--progress", "never", "--seed", std::to_string(seed)};
  const auto options = run_options(a);
  words.insert(words.end(), options.begin(), options.end());
  if (!rig.empty()) words.insert(words.end(), {"--rig", rig});
  return words;
}

// Name of the processor as the kernel reports it; empty if it does not.
std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "";
}

std::string failure_of(const ProcessEnd& end, const fs::path& log) {
  if (end.signal > 0) return fmt::format("ended by signal {} ({})", end.signal, ::strsignal(end.signal));
  switch (end.exit_status) {
    case kExitOk:
      return "";
    case kExitNothingTracked:
      return "no frame could be tracked";
    case kExitInterrupted:
      return "interrupted";
    default:
      return message_in(log);
  }
}

Status prepare_folder(const BenchArguments& a) {
  const fs::path folder = a.out;
  std::error_code error;
  const bool exists = fs::exists(folder, error);
  if (exists && !fs::is_directory(folder, error)) return Error{a.out, "--out", "a file", "a folder"};
  if (exists && !a.overwrite && !fs::is_empty(folder, error)) {
    return Error{a.out, "--out", "a folder that is not empty", "an empty or new folder, or --overwrite"};
  }
  fs::create_directories(folder, error);
  if (error) return Error{a.out, "--out", error.message(), "a folder that can be created"};
  return check_writable(folder / "report.md");
}

Status write_document(const report::Document& document, const fs::path& folder) {
  if (const Status s = write_atomically(folder / "report.md", report::markdown_text(document)); !s) return s;
  return write_atomically(folder / "report.html", report::html_text(document));
}

}  // namespace bslam::cli
