// Trajectories: TUM, EuRoC csv and KITTI poses with their times.
#include "evaluation/trajectory_file.h"
#include "target.h"

namespace bslam::fuzz {

// An input contains poses. Times for KITTI poses follow a line "====".
std::vector<std::string> seeds() {
  return {
      "# a comment\n1403636579.763555584 1 2 3 0 0 0 1\n1403636579.813555584 1.1 2 3 0 0 0.1 0.995\n1403636580 1.2 2 "
      "-3e-1 0 0 0.2 0.98\n",
      "#timestamp, p_RS_R_x "
      "[m]\n1403636579763555584,4.6,-1.7,0.8,0.53,-0.15,-0.82,-0.08,0.1,0.2\n1403636579813555584,4.6,-1.7,0.8,0.53,-0."
      "15,-0.82,-0.08\n",
      "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0.5\n====\n0.000000e+00\n1.036224e-01\n"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const std::string_view text = fuzz::as_text(data, size);
  const std::size_t split = text.find("====\n");
  const auto poses = fuzz::scratch_file("poses.txt", text.substr(0, split));
  const auto times = fuzz::scratch_file("times.txt", split == std::string_view::npos ? "" : text.substr(split + 5));
  const auto trajectory = evaluation::read_trajectory(poses, times);
  if (!trajectory) return 0;
  fuzz::require(!trajectory->empty(), "a trajectory must have poses");
  for (std::size_t i = 0; i < trajectory->size(); ++i) {
    const auto& p = (*trajectory)[i];
    fuzz::require(i == 0 || (*trajectory)[i - 1].time_ns < p.time_ns, "times must increase");
    fuzz::require(p.T_world_frame.translation().allFinite() && p.T_world_frame.rotation().coeffs().allFinite(),
                  "poses must be finite");
  }
  const auto csv =
      evaluation::read_trajectory(fuzz::scratch_file("again.csv", evaluation::euroc_csv_text(*trajectory)));
  fuzz::require(csv.ok() && csv->size() == trajectory->size(), "a written trajectory must be readable");
  const auto tum =
      evaluation::read_trajectory(fuzz::scratch_file("again.tum", evaluation::tum_text(*trajectory, "fuzz")));
  fuzz::require(tum.ok() && tum->size() == trajectory->size(), "a written trajectory must be readable");
  return 0;
}
