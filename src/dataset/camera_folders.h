// Which sub-folders of a folder are the images of cameras. Internal to this folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace bslam::dataset {

struct CameraFolder {
  std::string name;              // name of the sub-folder, which may be the name of a camera in the rig file
  std::filesystem::path images;  // the folder itself, or the only folder with images in it
};

struct CameraFolders {
  std::vector<CameraFolder> cameras;
  bool own_names = false;  // neither cam0, cam1, ..., nor left and right
  std::vector<std::string> warnings = {};
};

// Returns the folders cam0, cam1, ..., or left and right; else all sub-folders with images in the natural order of
// their names, without those whose names contain depth, mask or vignette; else the folder itself. `requested` are names
// of sub-folders in the order of the cameras; empty: all. Errors: a requested folder that has no images, or is named
// twice. No cameras if there are no images.
Result<CameraFolders> find_camera_folders(const std::filesystem::path& data, const std::vector<std::string>& requested);

// Returns the numbers N of folders called camN; empty unless all are.
std::vector<int> folder_numbers(const std::vector<std::string>& names);

}  // namespace bslam::dataset
