// Recordings in ROS 1 bags, ROS 2 bags and MCAP files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dataset/recording.h"

namespace bslam::dataset {

// Returns true for a file with the name or the first bytes of a bag or an MCAP file, and for a folder with
// metadata.yaml or such files.
bool looks_like_bag(const std::filesystem::path& path);

// Opens the files of one recording: bags, MCAP files, or the folder of a ROS 2 bag. `topics` are the image topics in
// the order of the cameras; if empty, all topics with images that can be read, by name. Errors: a file cannot be read;
// no image topic; an unknown topic is requested or one is requested twice.
RecordingResult open_bag(const std::vector<std::filesystem::path>& files, const std::vector<std::string>& topics);

}  // namespace bslam::dataset
