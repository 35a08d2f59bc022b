#include "cli/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

namespace bslam::cli {
namespace {

// Waits until the process has ended. It is not reaped before the stop callback is removed, so that its id cannot belong
// to another process when the signal is sent.
ProcessEnd wait_for(pid_t process, const std::stop_token& stop) {
  {
    const std::stop_callback forward(stop, [process] { ::kill(process, SIGINT); });
    siginfo_t info{};
    while (::waitid(P_PID, static_cast<id_t>(process), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
  }
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) return {.exit_status = 0, .signal = WTERMSIG(status)};
  return {.exit_status = WEXITSTATUS(status), .signal = 0};
}

}  // namespace

Result<ProcessEnd> run_program(const std::string& program, const std::vector<std::string>& arguments,
                               const std::filesystem::path& log, const std::stop_token& stop) {
  std::string name = program == kThisProgram ? "bslam" : program;
  std::vector<std::string> words = arguments;
  std::vector<char*> argv{name.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  ::posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = 0;
  const int failure = ::posix_spawnp(&process, program.c_str(), &files, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  if (failure != 0) return Error{log.string(), "", std::strerror(failure), "a process that can be started"};
  return wait_for(process, stop);
}

}  // namespace bslam::cli
