// Which cameras of the calibration and of the recording are used. Internal to this folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "camera/rig.h"
#include "dataset/recording.h"

namespace bslam::dataset {

struct ChosenRig {
  std::vector<int> cameras;  // their indices in the whole rig
  camera::Rig rig;
  std::optional<camera::Rig> whole;
  std::vector<std::string> warnings;
  std::vector<int> recorded = {};  // their indices in the recording
  bool by_name = false;            // the recorded cameras were found by the names of the rig
};

// Returns the requested cameras, or all `count` cameras if none were requested.
Result<std::vector<int>> chosen_cameras(const std::vector<int>& requested, std::size_t count);

// Returns the rig file in the folder of a recording, or nullopt if there is none.
std::optional<std::filesystem::path> rig_file_in_folder(const DatasetRequest& request);

struct RecordedCameras {
  std::vector<int> numbers;  // indices in the recording, one per camera of the rig
  bool by_name = false;
};

// Finds `cameras` of a rig in a recording: folders or topics with the names of the cameras, or else in their order.
// If cameras are selected, the number of folders may also equal the number of selected cameras, if there is one folder
// or the folders are requested by name. Errors: folders with names of their own of which only some are those of
// cameras, or which are not as many as the rig has; more topics than the rig has cameras; images of too few cameras.
Result<RecordedCameras> recorded_cameras(const DatasetRequest& request, const Recording& recording,
                                         const camera::Rig& rig, const std::vector<int>& cameras);

// The calibration of the rig file that is requested, or else that of the map. Errors: those of the file, and as above;
// more or fewer cameras than those of the map, whose order is then unknown.
Result<ChosenRig> choose_given(const DatasetRequest& request, const Recording& recording);
// The calibration that the recording contains.
Result<ChosenRig> choose_own(const DatasetRequest& request, const Recording& recording);

}  // namespace bslam::dataset
