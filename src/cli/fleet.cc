// bslam fleet: many recordings, by the Python package.
#include <unistd.h>

#include <string>
#include <vector>

#include "cli/child_process.h"
#include "cli/python_package.h"
#include "cli/verbs.h"

namespace bslam::cli {
namespace {

// Does not return if it succeeds.
int become_python(const std::vector<std::string>& arguments) {
  const std::string python = python_interpreter();
  const auto found = run_program(python, {"-c", python_code("import bslam.fleet")}, "/dev/null");
  if (found && found->exit_status == 0 && found->signal == 0) {
    std::string code = python_code("from bslam.fleet.__main__ import main; sys.exit(main())");
    std::vector<std::string> words = {python, "-c", code};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
  }
  return report_error({"command line", "fleet", "no Python package bslam", "the package, installed by pip",
                       "fleet needs the Python package bslam, which " + python +
                           " does not find: install it as in its documentation; BSLAM_PYTHON=PATH chooses the "
                           "interpreter"});
}

}  // namespace

void add_fleet(CLI::App& app, int& exit_status) {
  CLI::App* fleet = app.add_subcommand("fleet", "map many recordings on many machines (Python package)");
  fleet->prefix_command();
  fleet->set_help_flag();  // all options belong to the package
  fleet->callback([fleet, &exit_status] { exit_status = become_python(fleet->remaining()); });
}

}  // namespace bslam::cli
