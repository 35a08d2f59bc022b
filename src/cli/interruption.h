// Converts SIGINT and SIGTERM to stop requests.
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace bslam::cli {

// Once an object has been created, the signals no longer end the program, even after its destruction. Only one object
// may exist at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  // The first signal requests a stop.
  std::stop_token token() const { return first_.get_token(); }
  // The second signal requests this one.
  std::stop_token second() const { return second_.get_token(); }

 private:
  std::stop_source first_, second_;
  std::atomic<bool> over_ = false;
  std::jthread listener_;  // declared last, since it uses the other members
};

}  // namespace bslam::cli
