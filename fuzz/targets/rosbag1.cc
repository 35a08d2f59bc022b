// ROS 1 bags.
#include "recording_seeds.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  const auto messages = small_recording(support::Wire::kRos1);
  return {support::rosbag1_bytes(messages), support::rosbag1_bytes(messages, {"lz4", 2}),
          support::rosbag1_bytes(messages, {"bz2", 2}), support::rosbag1_bytes(messages, {"", 2, false})};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  check_message_file(scratch_file("a.bag", as_text(data, size)), size);
  return 0;
}
