// Trajectory files in the formats TUM, EuRoC csv and KITTI.
//
//   TUM    `t x y z qx qy qz qw` per line: seconds, metres; lines beginning with # are comments
//   EuRoC  `t,x,y,z,qw,qx,qy,qz[,...]` per line: integer nanoseconds, metres; further columns are ignored
//   KITTI  12 numbers per line, the upper three rows of T_world_frame; the times, in seconds, are in a separate file
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "evaluation/trajectory.h"
#include "evaluation/trajectory_header.h"

namespace bslam::evaluation {

enum class TrajectoryFormat { kTum, kEurocCsv, kKitti };

// Reads a trajectory. The format is recognised from the first line of data. Decimal seconds are converted to
// nanoseconds without floating-point rounding. `times` is the times file of KITTI poses, by default times.txt in the
// folder of `file`; other formats ignore it. The Error names the file and line: unreadable file, no poses, wrong number
// of fields, a value that is not a finite number, an invalid rotation, times that do not increase, different numbers of
// times and poses.
Result<Trajectory> read_trajectory(const std::filesystem::path& file,
                                   const std::optional<std::filesystem::path>& times = {});

// The path of the times file that read_trajectory would read for these KITTI poses. Returns nullopt if the file of the
// poses cannot be read or is not in KITTI format. The times file need not exist.
std::optional<std::filesystem::path> times_of_poses(const std::filesystem::path& file,
                                                    const std::optional<std::filesystem::path>& times = {});

// Converts decimal seconds ("1403636579.763555584", "1.044989e-01") to nanoseconds; digits beyond the ninth decimal are
// rounded half away from zero. Returns nullopt if the text is not a number or is beyond +-4e9 s.
std::optional<TimeNs> parse_seconds(std::string_view text);

// Returns the content of a trajectory file. TUM begins with "# HEADER" if `header` is not empty. In an EuRoC csv its
// lines follow the title in the first line, since many programs skip just one line. Seconds, metres and quaternions
// have nine decimals. KITTI contains poses only; `times_text` gives the matching times file.
std::string tum_text(const Trajectory& trajectory, std::string_view header);
std::string euroc_csv_text(const Trajectory& trajectory, std::string_view header = {});
std::string kitti_text(const Trajectory& trajectory);
std::string times_text(const Trajectory& trajectory);

// The path of the times file that write_trajectory writes for KITTI poses: times.txt in the same folder.
std::filesystem::path times_beside(const std::filesystem::path& poses);

// Writes a trajectory atomically. KITTI then also writes times.txt into the same folder. KITTI ignores `header`.
// Errors: a file cannot be written; times.txt exists, which may be that of a recording, unless `replace_times`;
// times.txt is the name of the poses themselves. In the last two cases nothing is written.
Status write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory, TrajectoryFormat format,
                        std::string_view header = {}, bool replace_times = false);

}  // namespace bslam::evaluation
