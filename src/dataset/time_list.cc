#include "dataset/time_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "dataset/time_stamps.h"
#include "evaluation/trajectory_file.h"
#include "image/frame_grouping.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListBytes = std::size_t{1} << 28;
constexpr const char* kLine = "TIME or TIME FILENAME, in seconds with a decimal point or in whole nanoseconds";

struct Line {
  std::size_t number = 0;
  std::string time, name;
};

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\"");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

// Splits a line at its first comma, or else at its first blank.
Line split_line(std::size_t number, const std::string& text) {
  const std::size_t comma = text.find(','), end = comma != std::string::npos ? comma : text.find_first_of(" \t");
  Line line{.number = number, .time = trimmed(text.substr(0, end)), .name = ""};
  if (end == std::string::npos) return line;
  line.name = trimmed(text.substr(end + 1));
  if (comma != std::string::npos) line.name = trimmed(line.name.substr(0, line.name.find(',')));
  return line;
}

Error line_error(const fs::path& file, const Line& line) {
  const std::string found = line.name.empty() ? line.time : line.time + " " + line.name;
  return {file.string(), fmt::format("line {}", line.number), found.substr(0, 60), kLine};
}

Result<std::vector<Line>> read_lines(const fs::path& file) {
  const auto text = read_text(file, kMaxListBytes);
  if (!text) return text.error();
  std::vector<Line> lines;
  std::istringstream stream(*text);
  std::size_t number = 0;
  for (std::string raw; std::getline(stream, raw);) {
    ++number;
    const std::string one = trimmed(raw);
    if (one.empty() || one.front() == '#') continue;
    Line line = split_line(number, one);
    if (!parse_double(line.time) && lines.empty() && file.extension() == ".csv") continue;  // names of the columns
    if (!parse_double(line.time) || (!line.name.empty() && parse_double(line.name))) return line_error(file, line);
    if (!lines.empty() && lines.front().name.empty() != line.name.empty()) return line_error(file, line);
    lines.push_back(std::move(line));
  }
  if (lines.empty()) return Error{file.string(), "", "no times", kLine};
  return lines;
}

bool is_whole(const Line& line) { return line.time.find_first_of(".eE") == std::string::npos; }

// Returns the error if the times are impossible for a camera, so that they are in another unit. A list may name the
// images of several cameras, each in a folder of its own.
Status check_interval(const TimeList& list, bool whole) {
  std::map<fs::path, std::vector<TimeNs>> cameras;
  for (std::size_t k = 0; k < list.times_ns.size(); ++k) {
    const fs::path folder = list.names.empty() ? fs::path() : fs::path(list.names[k]).parent_path();
    cameras[folder].push_back(list.times_ns[k]);
  }
  for (const auto& [folder, times_ns] : cameras) {
    if (times_ns.size() < 2) continue;
    const TimeNs interval_ns = image::median_interval(times_ns);
    if (interval_ns >= kShortestInterval && (whole || interval_ns <= kLongestInterval)) continue;
    return Error{
        list.file.string(), "",
        whole ? fmt::format("whole numbers {} apart", interval_ns)
              : fmt::format("times {:g} s apart", to_seconds(interval_ns)),
        "seconds with a decimal point, or whole nanoseconds; --stamp-unit UNIT says what whole numbers are, and "
        "--rate HZ uses the numbers in the names of the images instead"};
  }
  return {};
}

// Returns which of the files exist in the folder.
std::vector<fs::path> existing(const fs::path& folder, const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const std::string& name : names) {
    if (fs::is_regular_file(folder / name, error)) files.push_back(folder / name);
  }
  return files;
}

}  // namespace

Result<TimeList> read_time_list(const fs::path& file, bool unit_is_given) {
  const auto lines = read_lines(file);
  if (!lines) return lines.error();
  TimeList list{.file = file, .times_ns = {}, .names = {}};
  const bool whole = std::ranges::all_of(*lines, is_whole);
  list.in_seconds = !whole;
  if (unit_is_given && !whole)
    return Error{file.string(), "", "times with a decimal point, which are seconds", "whole numbers with --stamp-unit"};
  for (const Line& line : *lines) {
    const auto time = whole ? parse_integer(line.time) : evaluation::parse_seconds(line.time);
    if (!time || *time < 0 || *time > kMaxTime) return line_error(file, line);
    list.times_ns.push_back(*time);
    if (!line.name.empty()) list.names.push_back(line.name);
  }
  if (const Status s = unit_is_given ? Status() : check_interval(list, whole); !s) return s.error();
  return list;
}

Result<std::optional<fs::path>> find_time_list(const fs::path& folder, const fs::path& data) {
  const bool deeper = folder != data && folder.parent_path() != data;
  const std::string name = (deeper ? folder.parent_path() : folder).filename().string();
  const std::vector<std::string> usual = {"times.txt", "timestamps.txt", "times.csv", "timestamps.csv"};
  const std::vector<std::string> of_camera = {name + ".txt", name + ".csv"};
  std::vector<std::string> inside = usual;
  inside.insert(inside.end(), {"data.csv", of_camera[0], of_camera[1]});
  std::vector<std::pair<fs::path, std::vector<std::string>>> places = {{folder, inside}};
  if (deeper) places.emplace_back(folder.parent_path(), inside);
  if (folder != data) {
    places.emplace_back(data, of_camera);
    places.emplace_back(data, usual);
  }
  for (const auto& [place, names] : places) {
    const std::vector<fs::path> files = existing(place, names);
    if (files.empty()) continue;
    if (files.size() > 1) {
      return Error{place.string(), "",
                   fmt::format("{} and {}", files[0].filename().string(), files[1].filename().string()),
                   "one file with the times of the images"};
    }
    return std::optional(files.front());
  }
  return std::optional<fs::path>();
}

}  // namespace bslam::dataset
