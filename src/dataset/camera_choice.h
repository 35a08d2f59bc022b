// Which cameras of the calibration and of the recording are used. Internal to this folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "camera/rig.h"
#include "dataset/recording.h"
#include "rig_formats/rig_file.h"

namespace bslam::dataset {

struct ChosenRig {
  std::vector<int> cameras;  // their indices in the whole rig
  camera::Rig rig;
  std::optional<camera::Rig> whole;
  std::vector<std::string> warnings;
  std::vector<int> recorded = {};            // their indices in the recording
  bool by_name = false;                      // the recorded cameras were found by the names of the rig
  bool by_topic = false;                     // or by the topics that the rig file names
  std::vector<std::string> rig_topics = {};  // see rig_formats::RigFile
};

// Returns the requested cameras, or all `count` cameras if none were requested.
Result<std::vector<int>> chosen_cameras(const std::vector<int>& requested, std::size_t count);

// Returns the rig file in the folder of a recording, or nullopt if there is none.
std::optional<std::filesystem::path> rig_file_in_folder(const DatasetRequest& request);

struct RecordedCameras {
  std::vector<int> numbers;  // indices in the recording, one per camera of the rig
  bool by_name = false, by_topic = false;
  std::string warning = {};  // why topics that the rig file names are not used, although the recording has some of them
};

// Finds `cameras` of a rig in a recording: by the topics that the rig file names, if those of all are in the recording
// and no order was requested or recorded; or else by the names of the cameras in those of folders or topics; or else by
// the numbers with which they were recorded, if these are numbers of the rig and no name contradicts them; or else in
// their order. Without names and numbers, the recording may also have the selected cameras only, if it is of one camera
// or its order was requested. Errors: folders or topics of which only some have the names of cameras; folders with
// names of their own that are not as many as the rig has cameras; numbers of another rig; more topics than the rig has
// cameras; no images of a camera.
Result<RecordedCameras> recorded_cameras(const DatasetRequest& request, const Recording& recording,
                                         const rig_formats::RigFile& file, const std::vector<int>& cameras);

// The calibration of the rig file that is requested, or else that of the map. Errors: those of the file, and as above;
// more or fewer cameras than those of the map, whose order is then unknown.
Result<ChosenRig> choose_given(const DatasetRequest& request, const Recording& recording);
// The calibration that the recording contains.
Result<ChosenRig> choose_own(const DatasetRequest& request, const Recording& recording);

}  // namespace bslam::dataset
