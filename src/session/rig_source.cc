#include "session/rig_source.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "dataset/bag_recording.h"

namespace bslam::session {

Result<RigSource> read_rig_source(const dataset::DatasetRequest& recording) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(recording.path, error);
  const bool has_rig_file = folder && !rig_formats::files_of_rig(recording.path).empty();
  // A folder with bags and a calibration file is no recording, unless it is the folder of a ROS 2 bag.
  const bool may_be_bag = !has_rig_file || std::filesystem::exists(recording.path / "metadata.yaml", error);
  if (may_be_bag && dataset::looks_like_bag(recording.path)) {
    const auto opened = dataset::open_recording(recording);
    if (!opened && !has_rig_file) return opened.error();
    if (opened && opened->format == dataset::DatasetFormat::kBag) {
      const auto dataset = dataset::dataset_of(recording, *opened);
      if (!dataset) return dataset.error();
      const dataset::Recording& source = *opened->recording;
      return RigSource{{dataset->rig, rig_formats::RigFormat::kBslam, {}},
                       source.calibrated() ? source.calibration_origin() : "rig.yaml in the folder of the bag",
                       true};
    }
  }
  auto file = rig_formats::read_rig_file(recording.path);
  if (!file) return file.error();
  std::string format(rig_formats::format_name(file->format));
  return RigSource{*std::move(file), std::move(format)};
}

}  // namespace bslam::session
