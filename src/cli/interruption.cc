#include "cli/interruption.h"

#include <semaphore.h>

#include <csignal>

namespace bslam::cli {
namespace {

// A handler can reach nothing else and may do hardly more than post: to stop something takes locks. So a thread waits.
sem_t g_signalled;

void on_signal(int) { ::sem_post(&g_signalled); }

}  // namespace

Interruption::Interruption() {
  ::sem_init(&g_signalled, 0, 0);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  listener_ = std::jthread([this] {
    while (::sem_wait(&g_signalled) != 0) {  // woken by another signal
    }
    if (!over_) source_.request_stop();
  });
}

Interruption::~Interruption() {
  over_ = true;
  ::sem_post(&g_signalled);
}

}  // namespace bslam::cli
