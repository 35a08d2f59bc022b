#include "evaluation/trajectory_header.h"

#include <fmt/format.h>

#include <fstream>

namespace bslam::evaluation {

std::string scale_comment(std::string_view scale) { return fmt::format("scale={}: lengths are not in metres", scale); }

TrajectoryComments read_comments(const std::filesystem::path& file) {
  constexpr int kMaxLines = 100;
  TrajectoryComments out;
  std::ifstream in(file);
  std::string line;
  const auto word_after = [&](std::string_view key) {
    const std::size_t at = line.find(key);
    return at == std::string::npos
               ? std::string()
               : line.substr(at + key.size(), line.find_first_of(" :", at + key.size()) - at - key.size());
  };
  for (int n = 0; n < kMaxLines && std::getline(in, line) && line.starts_with('#'); ++n) {
    if (line.starts_with("# bslam trajectory")) out.frame = word_after(" frame=");
    if (line.starts_with("# scale=")) out.scale = word_after("# scale=");
  }
  return out;
}

std::string trajectory_header(std::string_view frame, PoseState state, std::string_view parent) {
  return fmt::format("bslam trajectory frame={} parent={} final={}", frame, parent, state == PoseState::kFinal);
}

}  // namespace bslam::evaluation
