// Folders of images in place of cameras: to try live runs without cameras.
#pragma once

#include <string>
#include <vector>

#include "capture/device.h"

namespace bslam::capture {

// Returns what opens each of these folders, cameras of one recording whose images are named by their time stamps in ns,
// such as mav0/cam0 of an EuRoC data set. Their images come when they are due: as long after the first read of any of
// them as they were taken after the first image of all. Each keeps its time stamp. A folder that is opened again goes
// on where it was.
OpenDevice play_folders(const std::vector<std::string>& folders);

}  // namespace bslam::capture
