// What `bslam live --record` writes into its MCAP files beside the images: which topic is which camera, the cameras in
// use with their numbers in the rig file and their masks, and that images recorded at the same time were one frame.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "camera/rig.h"
#include "containers/message_file.h"

namespace bslam::dataset {

constexpr const char* kLiveMetadata = "bslam.live";  // name of the metadata
constexpr const char* kLiveRigFile = "rig.yaml";     // name of the attachment, in the format of bslam

// Name of the attachment with the mask of a camera, a PNG. The rig has it as the mask of the camera: its path is that
// of the recording and this name.
std::string live_mask_file(std::size_t camera);

struct LiveRecording {
  std::vector<std::string> topics;  // topics of the cameras of the rig, in its order
  // For each topic: index of the camera in the rig file; empty if missing or invalid.
  std::vector<int> numbers;
  std::vector<camera::RigCamera> cameras;  // for each topic: the calibration; empty if the rig cannot be read
  geometry::SE3 T_cam0_rig;                // of the first topic; see camera::Rig
  std::vector<std::string> warnings;       // reasons for the user why the rig cannot be read

  // Returns the calibration of a topic, or nullptr.
  const camera::RigCamera* camera_of(const std::string& topic) const;
  // Returns T_cam0_rig if the topic is that of camera 0, or else the identity.
  geometry::SE3 turn_of(const std::string& topic) const;
  // Returns the number of the camera of a topic in the rig file of the run, or nullopt.
  std::optional<int> number_of(const std::string& topic) const;
};

// The values of the metadata for these topics, which are those of cameras `numbers` of the rig file.
std::map<std::string, std::string> live_metadata(const std::vector<std::string>& topics,
                                                 const std::vector<int>& numbers);

// Recordings of earlier versions have no masks: their rigs name the files on the computer that recorded. Returns the
// error if the file of such a mask of `rig`, which is that of the recording at `path`, does not exist.
Status check_masks(const std::filesystem::path& path, const camera::Rig& rig);

// Returns nullopt for other recordings.
std::optional<LiveRecording> live_recording_of(const containers::MessageFile& file);

}  // namespace bslam::dataset
