#include "cli/rerun.h"

#include <system_error>
#include <vector>

#include "base/atomic_file.h"
#include "base/split.h"
#include "cli/child_process.h"
#include "cli/python_package.h"

namespace bslam::cli {
namespace {

// The last line of a log that is not empty.
std::string last_line(const std::filesystem::path& log) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
  std::string out;
  const auto text = read_file(log, kMaxBytes);
  if (!text) return text.error().message();
  for (const std::string& line : split(*text, '\n')) {
    if (!line.empty()) out = line;
  }
  return out;
}

}  // namespace

Status check_rerun() {
  const auto end = run_program(python_interpreter(), {"-c", python_code("import bslam.rerun, rerun")}, "/dev/null");
  if (end && end->exit_status == 0 && end->signal == 0) return {};
  return Error{
      "command line", "--rerun", "no Python packages bslam and rerun-sdk", "both, installed by pip",
      "--rerun needs the Python packages bslam and rerun-sdk, which " + python_interpreter() +
          " does not find: pip install rerun-sdk, and bslam as in its documentation; BSLAM_PYTHON=PATH chooses "
          "the interpreter"};
}

Status send_to_rerun(const std::filesystem::path& folder, const std::string& target) {
  const bool address = target.find("://") != std::string::npos;
  const std::filesystem::path log = folder / "rerun.log";
  const auto end = run_program(python_interpreter(),
                               {"-c", python_code("import bslam.rerun; sys.exit(bslam.rerun.main())"), folder.string(),
                                address ? "--connect" : "--save", target},
                               log);
  if (!end) return end.error();
  if (end->exit_status != 0 || end->signal != 0)
    return Error{"--rerun", target, last_line(log), "a file or a viewer that takes the run; see " + log.string()};
  std::error_code error;
  std::filesystem::remove(log, error);
  return {};
}

}  // namespace bslam::cli
