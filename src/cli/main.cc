// The command line of bslam. Every command has its own file; this file only combines them.
#include <cstdio>
#include <exception>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "cli/command_line_error.h"
#include "cli/option_values.h"
#include "cli/print_message.h"
#include "cli/standard_streams.h"
#include "cli/verbs.h"
#include "cli/version.h"

namespace bslam::cli {
namespace {

// Runs the command that the arguments name, and returns its exit status.
int run_command(int argc, char** argv) {
  CLI::App app{"bslam: visual SLAM for rigs of any number of cameras"};
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  int exit_status = kExitOk;
  add_run(app, {argv, static_cast<std::size_t>(argc)}, exit_status);
  add_live(app, {argv, static_cast<std::size_t>(argc)}, exit_status);
  add_eval(app, exit_status);
  add_bench(app, exit_status);
#ifdef BSLAM_SIMULATOR
  add_simulate(app, exit_status);
#endif
  add_data(app, exit_status);
  add_inspect(app, exit_status);
  add_rig(app, exit_status);
  add_vocab(app, exit_status);
  add_map(app, exit_status);
  add_export(app, exit_status);
  add_serve(app, exit_status);
  add_fleet(app, exit_status);
  add_settings(app, exit_status);
  check_option_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // help and version
    return report_error(command_line_error(app, e));
  } catch (const std::exception& e) {              // for example out of memory; not an error in the request
    if (std::ferror(stdout) != 0) return kExitOk;  // fmt::print has failed, which finish_stdout reports
    print_message("bslam: {}\n", e.what());
    return kExitFailed;
  }
  return exit_status;
}

}  // namespace
}  // namespace bslam::cli

int main(int argc, char** argv) {
  using namespace bslam::cli;
#ifdef __GLIBC__
  // One heap for all threads: images are allocated in one and released in another, which fragments a heap per thread.
  mallopt(M_ARENA_MAX, 1);
#endif
  open_standard_streams();
  const int exit_status = run_command(argc, argv);
  const bslam::Status printed = finish_stdout();
  if (printed) return exit_status;
  const int unprinted = report_error(printed.error());
  return exit_status == kExitOk ? unprinted : exit_status;
}
