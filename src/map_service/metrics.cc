#include "map_service/metrics.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace bslam::map_service {
namespace {

// The shortest text of a number.
template <class T>
std::string number(T value) {
  return nlohmann::json(value).dump();
}

void begin_metric(std::string& text, const std::string& name, const char* type, const char* help) {
  text += "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n";
}

template <class T>
void append_metric(std::string& text, const std::string& name, const char* type, const char* help, T value) {
  begin_metric(text, name, type, help);
  text += name + " " + number(value) + "\n";
}

}  // namespace

void Metrics::count_request(std::string_view path, int status) {
  const std::lock_guard lock(mutex_);
  ++requests_[{std::string(path), status}];
  if (status == 503) ++rejected_;
}

void Metrics::count_frame(bool localised, double seconds) {
  const std::lock_guard lock(mutex_);
  ++(localised ? localised_ : not_localised_);
  seconds_ += seconds;
  const auto bucket = std::ranges::lower_bound(kBuckets, seconds);
  if (bucket != kBuckets.end()) ++buckets_[static_cast<std::size_t>(bucket - kBuckets.begin())];
}

std::string Metrics::text(const Gauges& gauges) const {
  const std::lock_guard lock(mutex_);
  std::string out;
  begin_metric(out, "bslam_requests_total", "counter", "Requests by path and status.");
  for (const auto& [key, count] : requests_)
    out += "bslam_requests_total{path=\"" + key.first + "\",status=\"" + number(key.second) + "\"} " + number(count) +
           "\n";
  append_metric(out, "bslam_rejected_total", "counter", "Requests that were answered with 503.", rejected_);
  begin_metric(out, "bslam_frames_total", "counter", "Frames by result.");
  out += "bslam_frames_total{localised=\"true\"} " + number(localised_) + "\n";
  out += "bslam_frames_total{localised=\"false\"} " + number(not_localised_) + "\n";
  const std::string latency = "bslam_latency_seconds";
  begin_metric(out, latency, "histogram", "Time from a whole request to its answer, of frames.");
  std::uint64_t cumulative = 0;
  for (std::size_t i = 0; i < kBuckets.size(); ++i) {
    cumulative += buckets_[i];
    out += latency + "_bucket{le=\"" + number(kBuckets[i]) + "\"} " + number(cumulative) + "\n";
  }
  const std::uint64_t frames = localised_ + not_localised_;
  out += latency + "_bucket{le=\"+Inf\"} " + number(frames) + "\n";
  out += latency + "_sum " + number(seconds_) + "\n" + latency + "_count " + number(frames) + "\n";
  append_metric(out, "bslam_queue_length", "gauge", "Requests that wait for a worker.", gauges.queue_length);
  append_metric(out, "bslam_queue_capacity", "gauge", "Requests that may wait.", gauges.queue_capacity);
  append_metric(out, "bslam_workers", "gauge", "Threads that localise.", gauges.workers);
  append_metric(out, "bslam_map_keyframes", "gauge", "Keyframes of the map.", gauges.keyframes);
  append_metric(out, "bslam_map_landmarks", "gauge", "Landmarks of the map.", gauges.landmarks);
  return out;
}

}  // namespace bslam::map_service
