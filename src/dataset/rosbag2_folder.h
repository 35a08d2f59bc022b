// The folder of a ROS 2 bag: metadata.yaml and the files of its messages.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace bslam::dataset {

struct BagFiles {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> warnings;  // for the user
};

// Returns the files with messages that metadata.yaml lists, or those in the folder if there is no metadata.yaml or it
// cannot be read. A listed file that is not there, or a file that is not listed, is a warning. Errors: no file.
Result<BagFiles> files_of_rosbag2(const std::filesystem::path& folder);

}  // namespace bslam::dataset
