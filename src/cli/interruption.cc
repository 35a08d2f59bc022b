#include "cli/interruption.h"

#include <semaphore.h>

#include <csignal>

namespace bslam::cli {
namespace {

// A signal handler may only call async-signal-safe functions such as sem_post. Requesting a stop takes locks, so a
// separate thread waits for the semaphore and requests the stop.
sem_t g_signalled;

void on_signal(int) { ::sem_post(&g_signalled); }

}  // namespace

Interruption::Interruption() {
  ::sem_init(&g_signalled, 0, 0);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  listener_ = std::jthread([this] {
    for (std::stop_source* source : {&first_, &second_}) {
      while (::sem_wait(&g_signalled) != 0) {  // interrupted by another signal
      }
      if (over_) return;
      source->request_stop();
    }
  });
}

Interruption::~Interruption() {
  over_ = true;
  ::sem_post(&g_signalled);
}

}  // namespace bslam::cli
