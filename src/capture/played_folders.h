// Plays folders of images as if they were cameras, to try live runs without cameras.
#pragma once

#include <string>
#include <vector>

#include "capture/device.h"

namespace bslam::capture {

// Returns a function that opens these folders as devices. They are the cameras of one recording, with images named by
// their time stamps in ns, such as mav0/cam0 of an EuRoC data set. Images are delivered at the recorded pace, counted
// from the first read of any folder, with their recorded time stamps. A folder that is opened again continues with its
// next image.
OpenDevice play_folders(const std::vector<std::string>& folders);

}  // namespace bslam::capture
