// Reads and writes rig calibrations in all supported formats (docs/calibration.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "rig_formats/bslam_rig.h"

namespace bslam::rig_formats {

enum class RigFormat { kBslam, kEuroc, kKalibr, kOpenvins, kOrbslam3, kOkvis2, kBasalt, kColmap, kKitti, kKittiRaw };

// Returns the name on the command line: bslam, euroc, kalibr, openvins, orbslam3, okvis2, basalt, colmap, kitti,
// kitti-raw.
std::string_view format_name(RigFormat format);
// Returns a format that can be written, by its name: all except those of KITTI.
std::span<const RigFormat> writable_formats();
std::optional<RigFormat> writable_format(std::string_view name);
// Returns the format implied by an output name: EuRoC for a folder (one that exists, or a name ending in /), Basalt for
// .json, otherwise bslam.
RigFormat format_of_output(const std::filesystem::path& out);

struct RigFile {
  camera::Rig rig;
  RigFormat format;
  std::vector<std::string> notes;        // how ambiguous content of the file was interpreted
  std::vector<std::string> topics = {};  // see camera::RigReading
};

// Returns true if the file begins like a saved map, which is no calibration, but contains one.
bool is_saved_map(const std::filesystem::path& file);

// Reads a rig in any supported format, which is recognised by the content. If `path` is a folder, reads the calibration
// in it, which may be an EuRoC or KITTI data set or a COLMAP rig. Errors name the file and the key: values that
// make_camera rejects, missing and repeated keys, wrong types, YAML syntax, and, in the format of bslam, unknown keys.
Result<RigFile> read_rig_file(const std::filesystem::path& path);
// The same, without format and notes.
Result<camera::Rig> read_rig(const std::filesystem::path& path);

// The files that read_rig_file reads: `path` or, if it is a folder, those of the calibration in it. Empty if there is
// none.
std::vector<std::filesystem::path> files_of_rig(const std::filesystem::path& path);

// Joins calibrations of parts of a rig, such as the camchains of several runs of Kalibr, by their common body frame, in
// the order of the files, which `read` reads. A name that is taken becomes camN, N being the index of the camera.
// Errors: those of `read`; the body frame of one of several files is its camera 0, so that the files have no common
// frame.
using RigReader = std::function<Result<RigFile>(const std::filesystem::path&)>;
Result<RigFile> read_joined_rigs(std::span<const std::filesystem::path> files, const RigReader& read = read_rig_file);

Status write_rig(const camera::Rig& rig, const std::filesystem::path& file);  // writes the format of bslam

// Writes `out`, which is a file, or, for EuRoC and COLMAP, a folder that is created. Returns notes on content that was
// not stored but does not affect a run (camera names). Errors: content that the format cannot store
// (rig_formats/rig_limits.h); a file that cannot be written. `topics`: see camera::RigReading; they are stored by the
// formats of bslam, Kalibr and OpenVINS.
Result<std::vector<std::string>> write_rig_as(const camera::Rig& rig, RigFormat format,
                                              const std::filesystem::path& out,
                                              const std::vector<std::string>& topics = {});
// The files that it writes for a rig of so many cameras.
std::vector<std::filesystem::path> files_written(RigFormat format, const std::filesystem::path& out,
                                                 std::size_t cameras);
// Returns the existing files that would be replaced, of EuRoC their folder.
std::vector<std::filesystem::path> files_in_the_way(RigFormat format, const std::filesystem::path& out);

// Parts of a rig that can be omitted if a format cannot store them.
enum class Droppable { kBodyFrame, kMasks, kRollingShutters, kTimeOffsets };
// Returns the rig without this part. Without a body frame, the body is camera 0.
camera::Rig without(const camera::Rig& rig, Droppable what);

}  // namespace bslam::rig_formats
