#include "cli/interruption.h"

#include <semaphore.h>

#include <csignal>

namespace bslam::cli {
namespace {

// Posting a semaphore is one of the few things a signal handler may do. Requesting a stop takes locks, so a thread
// waits for the semaphore and does that.
sem_t g_signalled;

void on_signal(int) { ::sem_post(&g_signalled); }

}  // namespace

Interruption::Interruption() {
  ::sem_init(&g_signalled, 0, 0);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  listener_ = std::jthread([this] {
    while (::sem_wait(&g_signalled) != 0) {  // interrupted by another signal
    }
    if (!over_) source_.request_stop();
  });
}

Interruption::~Interruption() {
  over_ = true;
  ::sem_post(&g_signalled);
}

}  // namespace bslam::cli
