#include "evaluation/trajectory_header.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/atomic_file.h"

namespace bslam::evaluation {
namespace {

constexpr std::string_view kHeader = "bslam trajectory", kImageStamps = "time stamps are those of the images";

// The word after a key, such as the one after " frame="; empty if the line does not contain the key.
std::string word_after(std::string_view line, std::string_view key) {
  const std::size_t at = line.find(key);
  if (at == std::string_view::npos) return {};
  line.remove_prefix(at + key.size());
  return std::string(line.substr(0, line.find_first_of(" :\r")));
}

void add_comment(std::string_view line, TrajectoryComments& out) {
  if (line.starts_with(kHeader)) {
    out.frame = word_after(line, " frame=");
    if (const std::string parent = word_after(line, " parent="); !parent.empty()) out.parent = parent;
    out.state = word_after(line, " final=") == "false" ? PoseState::kLive : PoseState::kFinal;
  }
  if (line.starts_with("scale=")) out.scale = word_after(line, "scale=");
  if (line.starts_with(kImageStamps)) out.image_stamps = true;
}

// Adds the comments in one line that begins with #. The title of a csv may be followed by several.
void add_comments(std::string_view line, TrajectoryComments& out) {
  constexpr std::string_view kComment = "# ";
  const std::size_t first = line.starts_with(kComment) ? 0 : line.find(kComment);
  if (first == 0) return add_comment(line.substr(kComment.size()), out);
  for (std::size_t at = first; at != std::string_view::npos; at = line.find(kComment, at + 1))
    add_comment(line.substr(at + kComment.size()), out);
}

}  // namespace

std::string scale_comment(std::string_view scale) { return fmt::format("scale={}: lengths are not in metres", scale); }

std::string image_stamp_comment() { return fmt::format("{}, without the time offset of camera 0", kImageStamps); }

std::string world_of_submap(std::size_t number) {
  return number == 0 ? "world" : fmt::format("world_of_submap_{}", number);
}

TrajectoryComments read_comments(const std::filesystem::path& file) {
  constexpr int kMaxLines = 100;
  TrajectoryComments out;
  const auto bytes = read_text(file, kMaxTrajectoryBytes);
  std::string_view text = bytes ? *bytes : std::string_view();
  for (int n = 0; n < kMaxLines && text.starts_with('#'); ++n) {
    const std::string_view line = text.substr(0, text.find('\n'));
    add_comments(line, out);
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  out.euroc_csv = text.substr(0, text.find('\n')).find(',') != std::string_view::npos;
  return out;
}

std::string trajectory_header(std::string_view frame, PoseState state, std::string_view parent) {
  return fmt::format("{} frame={} parent={} final={}", kHeader, frame, parent, state == PoseState::kFinal);
}

std::string text_of(const TrajectoryComments& comments) {
  std::string out = trajectory_header(comments.frame, comments.state, comments.parent);
  if (comments.scale != "metric") out += "\n# " + scale_comment(comments.scale);
  if (comments.image_stamps) out += "\n# " + image_stamp_comment();
  return out;
}

}  // namespace bslam::evaluation
