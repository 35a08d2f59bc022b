// Turns SIGINT and SIGTERM into a stop token.
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

  // Stop is requested by the first signal.
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::atomic<bool> over_ = false;
  std::jthread listener_;  // declared last, since it uses the other members
};

}  // namespace bslam::cli
