#include "cli/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "base/file_descriptor.h"

namespace bslam::cli {
namespace {

// Waits until the process has ended. It is not reaped before the stop callback is removed, so that its id cannot belong
// to another process when the signal is sent.
Result<ProcessEnd> wait_for(pid_t process, const std::stop_token& stop) {
  {
    const std::stop_callback forward(stop, [process] { ::kill(process, SIGINT); });
    siginfo_t info{};
    while (::waitid(P_PID, static_cast<id_t>(process), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
  }
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(process, &status, 0)) < 0 && errno == EINTR) {
  }
  if (ended < 0) return system_error("wait for", "a process", "its exit status");
  if (WIFSIGNALED(status)) return ProcessEnd{.exit_status = 0, .signal = WTERMSIG(status)};
  return ProcessEnd{.exit_status = WEXITSTATUS(status), .signal = 0};
}

// What a started process reads and writes: nothing, and the file `log`.
class FileActions {
 public:
  explicit FileActions(const std::filesystem::path& log) : failure_(::posix_spawn_file_actions_init(&actions_)) {
    constexpr int kToWrite = O_WRONLY | O_CREAT | O_TRUNC;
    initialised_ = failure_ == 0;
    if (failure_ == 0) failure_ = ::posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    if (failure_ == 0)
      failure_ = ::posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log.c_str(), kToWrite, 0644);
    if (failure_ == 0) failure_ = ::posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  ~FileActions() {
    if (initialised_) ::posix_spawn_file_actions_destroy(&actions_);
  }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;

  int failure() const { return failure_; }  // an error number; 0 if the actions are complete
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
  int failure_ = 0;
  bool initialised_ = false;
};

}  // namespace

Result<ProcessEnd> run_program(const std::string& program, const std::vector<std::string>& arguments,
                               const std::filesystem::path& log, const std::stop_token& stop) {
  std::string name = program == kThisProgram ? "bslam" : program;
  std::vector<std::string> words = arguments;
  std::vector<char*> argv{name.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  // A program that started this one may have ignored the signal, which is inherited: then nothing is known of the end.
  std::signal(SIGCHLD, SIG_DFL);
  pid_t process = 0;
  int failure = 0;
  {
    const FileActions files(log);
    failure = files.failure();
    if (failure == 0) failure = ::posix_spawnp(&process, program.c_str(), files.get(), nullptr, argv.data(), environ);
  }
  if (failure != 0) return Error{log.string(), "", std::strerror(failure), "a process that can be started"};
  return wait_for(process, stop);
}

}  // namespace bslam::cli
