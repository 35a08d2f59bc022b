// MCAP files, with messages of ROS 1, ROS 2 and Foxglove.
#include "recording_seeds.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  using support::Wire;
  return {support::mcap_bytes(small_recording(Wire::kCdr), Wire::kCdr),
          support::mcap_bytes(small_recording(Wire::kCdrBigEndian), Wire::kCdrBigEndian, {"lz4", 2}),
          support::mcap_bytes(small_recording(Wire::kProtobuf), Wire::kProtobuf, {"zstd", 2}),
          support::mcap_bytes(small_recording(Wire::kProtobuf), Wire::kProtobuf, {"", 0}),
          support::mcap_bytes(small_recording(Wire::kRos1), Wire::kRos1, {"", 2, false})};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  check_message_file(scratch_file("a.mcap", as_text(data, size)), size);
  return 0;
}
