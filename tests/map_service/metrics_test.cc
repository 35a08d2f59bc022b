#include "map_service/metrics.h"

#include <gtest/gtest.h>

namespace bslam::map_service {
namespace {

TEST(Metrics, CountsRequestsAndFrames) {
  Metrics metrics;
  metrics.count_request("/v1/localise", 200);
  metrics.count_request("/v1/localise", 200);
  metrics.count_request("/v1/localise", 503);
  metrics.count_frame(true, 0.1);
  metrics.count_frame(false, 0.15);
  metrics.count_frame(true, 60);
  const std::string text = metrics.text({.queue_length = 3, .queue_capacity = 16});
  for (const char* line :
       {"bslam_requests_total{path=\"/v1/localise\",status=\"200\"} 2\n",
        "bslam_requests_total{path=\"/v1/localise\",status=\"503\"} 1\n", "bslam_rejected_total 1\n",
        "bslam_frames_total{localised=\"true\"} 2\n", "bslam_frames_total{localised=\"false\"} 1\n",
        "bslam_latency_seconds_bucket{le=\"0.05\"} 0\n", "bslam_latency_seconds_bucket{le=\"0.1\"} 1\n",
        "bslam_latency_seconds_bucket{le=\"0.2\"} 2\n", "bslam_latency_seconds_bucket{le=\"10.0\"} 2\n",
        "bslam_latency_seconds_bucket{le=\"+Inf\"} 3\n", "bslam_latency_seconds_sum 60.25\n",
        "bslam_latency_seconds_count 3\n", "bslam_queue_length 3\n", "bslam_queue_capacity 16\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.back(), '\n');
}

}  // namespace
}  // namespace bslam::map_service
