#include "benchmark/sequence.h"

#include <algorithm>

namespace bslam::benchmark {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

bool is_folder(const fs::path& folder) {
  std::error_code error;
  return fs::is_directory(folder, error);
}

bool is_kitti(const fs::path& folder) {
  if (!is_file(folder / "times.txt")) return false;
  return std::ranges::any_of(std::vector{"image_0", "image_1", "image_2", "image_3"},
                             [&](const char* name) { return is_folder(folder / name); });
}

bool is_sequence(const fs::path& folder) { return is_folder(folder / "mav0") || is_kitti(folder); }

std::optional<Truth> released_truth(const fs::path& folder, const std::string& name) {
  const fs::path mav0 = folder / "mav0", times = folder / "times.txt";
  const Truth candidates[] = {{mav0 / "state_groundtruth_estimate0" / "data.csv", TruthFrame::kBody},
                              {mav0 / "mocap0" / "data.csv", TruthFrame::kBody},
                              {folder / "dso" / "gt_imu.csv", TruthFrame::kBody},
                              {folder / "poses.txt", TruthFrame::kCamera0, times},
                              {folder / ".." / ".." / "poses" / (name + ".txt"), TruthFrame::kCamera0, times},
                              {folder / "groundtruth_cam0.tum", TruthFrame::kCamera0}};
  for (const Truth& truth : candidates) {
    if (is_file(truth.file)) return truth;
  }
  return std::nullopt;
}

Sequence sequence_at(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  const fs::path named = absolute.has_filename() ? absolute : absolute.parent_path();
  Sequence s{.name = named.filename().string(), .folder = named, .released = {}, .corrected = {}, .rig = {}};
  s.released = released_truth(named, s.name);
  if (const fs::path file = named / "groundtruth_body.tum"; is_file(file)) s.corrected = {file, TruthFrame::kBody};
  const fs::path chain = named / "dso" / "camchain.yaml";
  if (is_file(chain) && !is_file(named / "mav0" / "cam0" / "sensor.yaml")) s.rig = chain;
  return s;
}

}  // namespace

Result<std::vector<Sequence>> find_sequences(const fs::path& folder) {
  if (!is_folder(folder)) return Error{folder.string(), "", "no such folder", "a folder of sequences, or one sequence"};
  std::vector<Sequence> sequences;
  if (is_sequence(folder)) {
    sequences.push_back(sequence_at(folder));
    return sequences;
  }
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (is_sequence(entry.path())) sequences.push_back(sequence_at(entry.path()));
  }
  if (sequences.empty()) {
    return Error{folder.string(), "", "no sequence",
                 "mav0 (EuRoC, TUM-VI), or image_N and times.txt (KITTI), in the folder or in its subfolders"};
  }
  std::ranges::sort(sequences, {}, &Sequence::name);
  return sequences;
}

}  // namespace bslam::benchmark
