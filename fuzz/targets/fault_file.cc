// Lists of faults of a simulated recording.
#include "simulator/fault_file.h"

#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  return {
      "- {type: black, cameras: [2], from: 3.0, to: 5.0}\n- {type: delayed, cameras: [3, 0], from: 0, to: 20, delay_s: "
      "0.015}\n",
      "[{\"type\": \"frozen\", \"cameras\": [0], \"from\": 1, \"to\": 2}]"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const auto faults = simulator::read_faults(fuzz::scratch_file("faults.yaml", fuzz::as_text(data, size)), 4);
  if (!faults) return 0;
  for (const simulator::Fault& f : *faults) {
    fuzz::require(!f.cameras.empty() && f.from_s >= 0 && f.to_s > f.from_s && f.delay_s >= 0,
                  "the interval of a fault must not be empty");
    for (const int c : f.cameras) fuzz::require(c >= 0 && c < 4, "the camera must be in the rig");
  }
  return 0;
}
