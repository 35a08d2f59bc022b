// ROS 2 bags in SQLite files.
#include <fstream>
#include <iterator>

#include "recording_seeds.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> out;
  for (const bool zstd : {false, true}) {
    const std::filesystem::path file = scratch_folder() / (zstd ? "zstd" : "plain");
    support::write_sqlite_bag(file, small_recording(support::Wire::kCdr), zstd);
    std::ifstream in(file, std::ios::binary);
    out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return out;
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  check_message_file(scratch_file("a.db3", as_text(data, size)), size);
  return 0;
}
