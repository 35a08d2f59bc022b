// Counters of the service in the text format of Prometheus. Their names are documented in docs/serve.md.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace bslam::map_service {

// Current values.
struct Gauges {
  std::size_t queue_length = 0, queue_capacity = 0, workers = 0, keyframes = 0, landmarks = 0;
};

// All functions are thread-safe.
class Metrics {
 public:
  // A request that was answered. `path` must be one of a fixed number.
  void count_request(std::string_view path, int status);
  // A frame that was processed. `seconds`: from the whole request to the answer.
  void count_frame(bool localised, double seconds);

  std::string text(const Gauges& gauges) const;

 private:
  // Upper bounds of the buckets of the latency in seconds.
  static constexpr std::array<double, 11> kBuckets = {0.025, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1, 2, 5, 10};

  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::uint64_t> requests_;  // by path and status; guarded, as all below
  std::array<std::uint64_t, kBuckets.size()> buckets_{};           // not cumulative
  std::uint64_t localised_ = 0, not_localised_ = 0, rejected_ = 0;
  double seconds_ = 0;
};

}  // namespace bslam::map_service
