#include "cli/rerun.h"

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "base/atomic_file.h"
#include "base/split.h"
#include "cli/child_process.h"
#include "cli/python_package.h"

namespace bslam::cli {
namespace {

constexpr int kNoViewer = 3;  // exit status of the check

// The text without the escape sequences and other characters by which programs colour their messages.
std::string plain(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\x1b' && i + 1 < text.size() && text[i + 1] == '[')
      i = std::min(text.find_first_not_of("0123456789;?", i + 2), text.size());
    else if (static_cast<unsigned char>(text[i]) >= ' ')
      out += text[i];
  }
  return out;
}

// The last line of a log that is not empty.
std::string last_line(const std::filesystem::path& log) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
  std::string out;
  const auto text = read_file(log, kMaxBytes);
  if (!text) return text.error().message();
  for (const std::string& line : split(*text, '\n')) {
    if (std::string text_of_line = plain(line); !text_of_line.empty()) out = std::move(text_of_line);
  }
  return out;
}

}  // namespace

bool is_viewer(const std::string& target) { return target.find("://") != std::string::npos; }

Status check_rerun(const std::string& target) {
  const std::string statements =
      is_viewer(target) ? "sys.exit(0 if bslam.rerun.is_reachable(sys.argv[1]) else " + std::to_string(kNoViewer) + ")"
                        : "";
  const auto end = run_program(python_interpreter(),
                               {"-c", python_code("import bslam.rerun, rerun; " + statements), target}, "/dev/null");
  if (end && end->exit_status == 0 && end->signal == 0) return {};
  if (end && end->exit_status == kNoViewer)
    return Error{"command line", "--rerun", "no viewer at " + target, "a viewer that was started before the run"};
  return Error{
      "command line", "--rerun", "no Python packages bslam and rerun-sdk", "both, installed by pip",
      "--rerun needs the Python packages bslam and rerun-sdk, which " + python_interpreter() +
          " does not find: pip install rerun-sdk, and bslam as in its documentation; BSLAM_PYTHON=PATH chooses "
          "the interpreter"};
}

Status send_to_rerun(const std::filesystem::path& folder, const std::string& target) {
  const std::filesystem::path log = folder / "rerun.log";
  const auto end = run_program(python_interpreter(),
                               {"-c", python_code("import bslam.rerun; sys.exit(bslam.rerun.main())"), folder.string(),
                                is_viewer(target) ? "--connect" : "--save", target},
                               log);
  if (!end) return end.error();
  if (end->exit_status != 0 || end->signal != 0)
    return Error{"--rerun", target, last_line(log), "a file or a viewer that takes the run; see " + log.string()};
  std::error_code error;
  std::filesystem::remove(log, error);
  return {};
}

}  // namespace bslam::cli
