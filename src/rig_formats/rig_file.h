// Rig calibrations in files of any format people have: docs/calibration.md.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "rig_formats/bslam_rig.h"

namespace bslam::rig_formats {

enum class RigFormat { kBslam, kEuroc, kKalibr, kOpenvins, kOrbslam3, kBasalt, kColmap, kKitti, kKittiRaw };

// As on the command line: bslam, euroc, kalibr, openvins, orbslam3, basalt, colmap, kitti, kitti-raw.
std::string_view format_name(RigFormat format);
// The formats that can be written, all but KITTI's.
std::span<const RigFormat> writable_formats();
std::optional<RigFormat> writable_format(std::string_view name);
// The one a name stands for: a folder (ends in / or exists) is EuRoC's, .json Basalt's, anything else ours.
RigFormat format_of_output(const std::filesystem::path& out);

struct RigFile {
  camera::Rig rig;
  RigFormat format;
  std::vector<std::string> notes;  // how the file was understood where it leaves a choice
};

// Reads a rig of any known format, recognised by its content; where `path` is a folder, the calibration it holds: an
// EuRoC or KITTI data set, or a COLMAP rig. Errors name file and key: what make_camera checks, missing and repeated
// keys, wrong types, YAML syntax; in our own format unknown keys too.
Result<RigFile> read_rig_file(const std::filesystem::path& path);
// The same, of interest for the rig alone.
Result<camera::Rig> read_rig(const std::filesystem::path& path);

Status write_rig(const camera::Rig& rig, const std::filesystem::path& file);  // in our format

// Writes `out`, a file, or a folder for EuRoC and COLMAP, which is made. Notes tell what is not kept and cannot matter
// to a run: names of cameras. Errors: what the format cannot hold (io/rig_limits.h); a file that cannot be written.
Result<std::vector<std::string>> write_rig_as(const camera::Rig& rig, RigFormat format,
                                              const std::filesystem::path& out);
// The files that writing would replace.
std::vector<std::filesystem::path> files_in_the_way(RigFormat format, const std::filesystem::path& out);

// What a user may give up so that a format can hold the rest.
enum class Droppable { kBodyFrame, kMasks, kTimeOffsets };
// The rig without it; without its body frame, that is camera 0.
camera::Rig without(const camera::Rig& rig, Droppable what);

}  // namespace bslam::rig_formats
