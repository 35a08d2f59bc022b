#include "evaluation/trajectory_file.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "base/atomic_file.h"
#include "base/exact_seconds.h"

namespace bslam::evaluation {

namespace {

using evaluation::TimedPose;
using evaluation::Trajectory;
using geometry::Matrix3d;
using geometry::Quaterniond;
using geometry::SE3;
using geometry::Vector3d;

constexpr TimeNs kLargestTimeNs = 4'000'000'000'000'000'000;  // differences of two times fit into 64 bits
constexpr double kRotationTolerance = 1e-2;                   // accepts rotations written with three decimals
constexpr std::size_t kTumFields = 8, kEurocFields = 8, kKittiFields = 12;

// One line of data: its line number, starting at 1, and its fields.
struct Line {
  std::size_t number = 0;
  std::vector<std::string_view> fields;
  bool commas = false;
};

Error line_error(const std::filesystem::path& file, std::size_t line, std::string found, std::string expected) {
  return {.file = file.string(),
          .key = fmt::format("line {}", line),
          .found = std::move(found),
          .expected = std::move(expected)};
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kShown = 40;
  return text.size() <= kShown ? fmt::format("'{}'", text) : fmt::format("'{}...'", text.substr(0, kShown));
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\v\f";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::vector<std::string_view> split(std::string_view text, bool commas) {
  std::vector<std::string_view> fields;
  while (commas) {
    const std::size_t end = text.find(',');
    fields.push_back(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    text.remove_prefix(end + 1);
  }
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    fields.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return fields;
}

bool is_csv_title(std::string_view line) {
  return line.find(',') != std::string_view::npos &&
         ((line[0] >= 'a' && line[0] <= 'z') || (line[0] >= 'A' && line[0] <= 'Z'));
}

// Splits a file into lines of data, without comments, blank lines and the title line of a csv file.
std::vector<Line> data_lines(std::string_view bytes) {
  std::vector<Line> lines;
  for (std::size_t number = 1; !bytes.empty(); ++number) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    const std::string_view line = trimmed(bytes.substr(0, end));
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    if (line.empty() || line[0] == '#' || (lines.empty() && is_csv_title(line))) continue;
    const bool commas = line.find(',') != std::string_view::npos;
    lines.push_back({number, split(line, commas), commas});
  }
  return lines;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Appends a decimal digit to `value`; returns false on overflow of 64 bits.
bool append_digit(TimeNs& value, char digit) {
  constexpr TimeNs kMax = std::numeric_limits<TimeNs>::max();
  if (value > (kMax - 9) / 10) return false;
  value = value * 10 + (digit - '0');
  return true;
}

// Parses `Count` finite numbers starting at field `first`; the Error names the first invalid one.
template <std::size_t Count>
Result<std::array<double, Count>> numbers(const std::filesystem::path& file, const Line& line, std::size_t first) {
  std::array<double, Count> values{};
  for (std::size_t k = 0; k < Count; ++k) {
    const std::string_view field = line.fields[first + k];
    const std::optional<double> value = parse_number(field);
    if (!value) return line_error(file, line.number, quoted(field), "a finite number");
    values[k] = *value;
  }
  return values;
}

Result<SE3> checked_pose(const std::filesystem::path& file, const Line& line, const Quaterniond& q, const Vector3d& p) {
  const double norm = q.norm();
  if (!(std::abs(norm - 1.0) <= kRotationTolerance)) {
    return line_error(file, line.number, fmt::format("a quaternion of norm {:.6g}", norm), "norm 1");
  }
  return SE3(q, p);
}

Result<TimedPose> tum_pose(const std::filesystem::path& file, const Line& line) {
  const std::optional<TimeNs> time = parse_seconds(line.fields[0]);
  if (!time) return line_error(file, line.number, quoted(line.fields[0]), "a time in seconds");
  const auto v = numbers<7>(file, line, 1);
  if (!v) return v.error();
  const auto& [x, y, z, qx, qy, qz, qw] = *v;
  const auto pose = checked_pose(file, line, Quaterniond(qw, qx, qy, qz), Vector3d(x, y, z));
  if (!pose) return pose.error();
  return TimedPose{*time, *pose};
}

Result<TimedPose> euroc_pose(const std::filesystem::path& file, const Line& line) {
  TimeNs time = 0;
  const std::string_view text = line.fields[0];
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), time);
  if (error != std::errc() || end != text.data() + text.size() || time > kLargestTimeNs || time < -kLargestTimeNs) {
    return line_error(file, line.number, quoted(text), "a time in integer nanoseconds");
  }
  const auto v = numbers<7>(file, line, 1);
  if (!v) return v.error();
  const auto& [x, y, z, qw, qx, qy, qz] = *v;
  const auto pose = checked_pose(file, line, Quaterniond(qw, qx, qy, qz), Vector3d(x, y, z));
  if (!pose) return pose.error();
  return TimedPose{time, *pose};
}

Result<SE3> kitti_pose(const std::filesystem::path& file, const Line& line) {
  const auto v = numbers<12>(file, line, 0);
  if (!v) return v.error();
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(v->data());
  const Matrix3d R = T.leftCols<3>();
  const double off = (R * R.transpose() - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance) || R.determinant() < 0) {
    return line_error(file, line.number, "a matrix that is not a rotation",
                      "the upper three rows of a rigid transform");
  }
  return SE3(R, T.col(3));
}

// Reads the times that belong to KITTI poses, one per line.
Result<std::vector<TimeNs>> read_times(const std::filesystem::path& file) {
  const auto bytes = read_text(file, kMaxTrajectoryBytes);
  if (!bytes) return bytes.error();
  std::vector<TimeNs> times;
  for (const Line& line : data_lines(*bytes)) {
    const std::optional<TimeNs> time = line.fields.size() == 1 ? parse_seconds(line.fields[0]) : std::nullopt;
    if (!time) return line_error(file, line.number, quoted(line.fields[0]), "one time in seconds");
    times.push_back(*time);
  }
  return times;
}

Status check_field_count(const std::filesystem::path& file, const Line& line, TrajectoryFormat format) {
  const std::size_t found = line.fields.size();
  const auto error = [&](const char* expected) {
    return Status(line_error(file, line.number,
                             fmt::format("{} {}fields", found, line.commas ? "comma-separated " : ""), expected));
  };
  switch (format) {
    case TrajectoryFormat::kTum:
      if (line.commas || found != kTumFields) return error("8 (t x y z qx qy qz qw), in TUM files");
      break;
    case TrajectoryFormat::kEurocCsv:
      if (!line.commas || found < kEurocFields) return error("at least 8 (ns,x,y,z,qw,qx,qy,qz), in EuRoC csv files");
      break;
    case TrajectoryFormat::kKitti:
      if (line.commas || found != kKittiFields) return error("12 (rows of a 3x4 matrix), in KITTI pose files");
      break;
  }
  return {};
}

Result<TrajectoryFormat> detect_format(const std::filesystem::path& file, const std::vector<Line>& lines) {
  if (lines.empty()) {
    return Error{
        .file = file.string(), .key = {}, .found = "no poses", .expected = "a TUM, EuRoC csv or KITTI trajectory"};
  }
  const Line& first = lines.front();
  if (first.commas && first.fields.size() >= kEurocFields) return TrajectoryFormat::kEurocCsv;
  if (!first.commas && first.fields.size() == kTumFields) return TrajectoryFormat::kTum;
  if (!first.commas && first.fields.size() == kKittiFields) return TrajectoryFormat::kKitti;
  return line_error(file, first.number, fmt::format("{} fields", first.fields.size()),
                    "8 (TUM), at least 8 with commas (EuRoC csv) or 12 (KITTI)");
}

Result<Trajectory> kitti_trajectory(const std::filesystem::path& file, const std::vector<Line>& lines,
                                    const std::optional<std::filesystem::path>& times_option) {
  const std::filesystem::path times_file = times_option.value_or(times_beside(file));
  std::error_code error;
  if (!times_option && !std::filesystem::exists(times_file, error)) {
    return Error{.file = file.string(),
                 .key = {},
                 .found = "KITTI poses without times",
                 .expected = "times.txt in the same folder, or --times FILE"};
  }
  const auto times = read_times(times_file);
  if (!times) return times.error();
  if (times->size() != lines.size()) {
    return Error{.file = times_file.string(),
                 .key = {},
                 .found = fmt::format("{} times", times->size()),
                 .expected = fmt::format("{} (one per pose of {})", lines.size(), file.string())};
  }
  Trajectory trajectory;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (const Status status = check_field_count(file, lines[i], TrajectoryFormat::kKitti); !status)
      return status.error();
    const auto pose = kitti_pose(file, lines[i]);
    if (!pose) return pose.error();
    if (i > 0 && (*times)[i] <= (*times)[i - 1]) {
      return Error{.file = times_file.string(),
                   .key = fmt::format("time {}", i + 1),
                   .found = fmt::format("{} s after {} s", to_seconds((*times)[i]), to_seconds((*times)[i - 1])),
                   .expected = "increasing times"};
    }
    trajectory.push_back({(*times)[i], *pose});
  }
  return trajectory;
}

}  // namespace

std::filesystem::path times_beside(const std::filesystem::path& poses) { return poses.parent_path() / "times.txt"; }

std::optional<TimeNs> parse_seconds(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  int exponent = 9;  // decimal exponent of the digits, in nanoseconds
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    std::string_view power = text.substr(e + 1);
    if (power.starts_with('+')) power.remove_prefix(1);
    int value = 0;
    const auto [end, error] = std::from_chars(power.data(), power.data() + power.size(), value);
    if (error != std::errc() || end != power.data() + power.size() || (value < -100 || value > 100))
      return std::nullopt;
    exponent += value;
    text = text.substr(0, e);
  }
  const std::size_t point = text.find('.');
  const std::size_t whole = std::min(point, text.size());
  exponent += static_cast<int>(whole);
  std::string digits(text.substr(0, whole));
  if (point != std::string_view::npos) digits += text.substr(point + 1);
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;

  // The value is 0.DIGITS * 10^exponent: the first `exponent` digits are whole nanoseconds, and the next one determines
  // the rounding.
  TimeNs value = 0;
  for (int k = 0; k < exponent; ++k) {
    const std::size_t at = static_cast<std::size_t>(k);
    if (!append_digit(value, at < digits.size() ? digits[at] : '0')) return std::nullopt;
  }
  if (exponent >= 0 && static_cast<std::size_t>(exponent) < digits.size() &&
      digits[static_cast<std::size_t>(exponent)] >= '5') {
    ++value;
  }
  if (value > kLargestTimeNs) return std::nullopt;
  return negative ? -value : value;
}

std::optional<std::filesystem::path> times_of_poses(const std::filesystem::path& file,
                                                    const std::optional<std::filesystem::path>& times) {
  const auto text = read_text(file, kMaxTrajectoryBytes);
  if (!text) return std::nullopt;
  const auto format = detect_format(file, data_lines(*text));
  if (!format || *format != TrajectoryFormat::kKitti) return std::nullopt;
  return times.value_or(times_beside(file));
}

Result<Trajectory> read_trajectory(const std::filesystem::path& file,
                                   const std::optional<std::filesystem::path>& times) {
  const auto bytes = read_text(file, kMaxTrajectoryBytes);
  if (!bytes) return bytes.error();
  const std::vector<Line> lines = data_lines(*bytes);
  const auto format = detect_format(file, lines);
  if (!format) return format.error();
  if (*format == TrajectoryFormat::kKitti) return kitti_trajectory(file, lines, times);
  Trajectory trajectory;
  trajectory.reserve(lines.size());
  for (const Line& line : lines) {
    if (const Status status = check_field_count(file, line, *format); !status) return status.error();
    const auto pose = *format == TrajectoryFormat::kTum ? tum_pose(file, line) : euroc_pose(file, line);
    if (!pose) return pose.error();
    if (!trajectory.empty() && pose->time_ns <= trajectory.back().time_ns) {
      return line_error(file, line.number,
                        exact_seconds(pose->time_ns) + " s after " + exact_seconds(trajectory.back().time_ns) + " s",
                        "increasing times");
    }
    trajectory.push_back(*pose);
  }
  return trajectory;
}

std::string tum_text(const Trajectory& trajectory, std::string_view header) {
  std::string text = header.empty() ? std::string() : fmt::format("# {}\n", header);
  for (const TimedPose& pose : trajectory) {
    const Vector3d& p = pose.T_world_frame.translation();
    const Quaterniond& q = pose.T_world_frame.rotation();
    fmt::format_to(std::back_inserter(text), "{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                   exact_seconds(pose.time_ns), p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string euroc_csv_text(const Trajectory& trajectory, std::string_view header) {
  std::string text = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []";
  if (!header.empty()) text += " # ";
  for (const char c : header) {  // without further columns
    if (c == '\n') text += ' ';
    if (c != '\n' && c != ',') text += c;
  }
  text += '\n';
  for (const TimedPose& pose : trajectory) {
    const Vector3d& p = pose.T_world_frame.translation();
    const Quaterniond& q = pose.T_world_frame.rotation();
    fmt::format_to(std::back_inserter(text), "{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", pose.time_ns,
                   p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
  }
  return text;
}

std::string kitti_text(const Trajectory& trajectory) {
  std::string text;
  for (const TimedPose& pose : trajectory) {
    const Eigen::Matrix4d T = pose.T_world_frame.matrix();
    for (int k = 0; k < 12; ++k) {
      fmt::format_to(std::back_inserter(text), "{:.9e}{}", T(k / 4, k % 4), k == 11 ? '\n' : ' ');
    }
  }
  return text;
}

std::string times_text(const Trajectory& trajectory) {
  std::string text;
  for (const TimedPose& pose : trajectory) text += exact_seconds(pose.time_ns) + "\n";
  return text;
}

Status write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory, TrajectoryFormat format,
                        std::string_view header, bool replace_times) {
  switch (format) {
    case TrajectoryFormat::kTum:
      return write_atomically(file, tum_text(trajectory, header));
    case TrajectoryFormat::kEurocCsv:
      return write_atomically(file, euroc_csv_text(trajectory, header));
    case TrajectoryFormat::kKitti:
      break;
  }
  const std::filesystem::path times = times_beside(file);
  std::error_code error;
  if (file.filename() == times.filename())
    return Error{file.string(), "--out", "the name of the times of KITTI poses", "another name"};
  if (!replace_times && std::filesystem::exists(std::filesystem::symlink_status(times, error)))
    return Error{times.string(), "--out", "an existing file, beside which the poses would be written",
                 "a folder without times.txt, or --overwrite"};
  if (Status status = write_atomically(file, kitti_text(trajectory)); !status) return status;
  return write_atomically(times, times_text(trajectory));
}

}  // namespace bslam::evaluation
