// Trajectories in files: TUM, EuRoC csv and KITTI poses.
//
//   TUM    `t x y z qx qy qz qw` a line: seconds, metres; lines beginning with # are comments
//   EuRoC  `t,x,y,z,qw,qx,qy,qz[,...]` a line: integer nanoseconds, metres; further columns are not read
//   KITTI  12 numbers a line, the upper rows of T_world_frame; the times, in seconds, stand in a file of their own
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "evaluation/trajectory.h"

namespace bslam::evaluation {

enum class TrajectoryFormat { kTum, kEurocCsv, kKitti };

// Reads a trajectory; the format is told by the first line of data. Decimal seconds become nanoseconds without passing
// through a floating-point number. `times` is the times file of KITTI poses, by default times.txt beside `file`; the
// other formats do not look at it. An Error names file and line: not readable, no poses, wrong count of fields, not a
// finite number, no rotation, times that do not increase, times and poses of different number.
Result<evaluation::Trajectory> read_trajectory(const std::filesystem::path& file,
                                               const std::optional<std::filesystem::path>& times = {});

// Decimal seconds ("1403636579.763555584", "1.044989e-01") as nanoseconds, rounded half away from zero where the text
// has more than nine decimals. Empty where it is no number or beyond +-4e9 s.
std::optional<TimeNs> parse_seconds(std::string_view text);

// Whether the poses are resolved against the final map, or as the caller was told at the time.
enum class PoseState { kFinal, kLive };

// "bslam trajectory frame=cam0 parent=world final=true", the comment line that begins the trajectories of a run.
std::string trajectory_header(std::string_view frame, PoseState state);

// The bytes of a file. TUM begins with "# HEADER" where `header` is not empty. Nine decimals for seconds, metres and
// quaternions; KITTI has the poses only (`times_text` gives the file that belongs to it).
std::string tum_text(const evaluation::Trajectory& trajectory, std::string_view header);
std::string euroc_csv_text(const evaluation::Trajectory& trajectory);
std::string kitti_text(const evaluation::Trajectory& trajectory);
std::string times_text(const evaluation::Trajectory& trajectory);

// Writes a trajectory beside its place and renames it. KITTI also writes times.txt in the same folder. `header` is for
// TUM.
Status write_trajectory(const std::filesystem::path& file, const evaluation::Trajectory& trajectory,
                        TrajectoryFormat format, std::string_view header = {});

}  // namespace bslam::evaluation
