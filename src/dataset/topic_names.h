// What the names of image topics say about their cameras. Internal to this folder.
#pragma once

#include <string>

namespace bslam::dataset {

// "/cam0/image_raw/compressed" -> "/cam0/image_raw", the topic of which it is a copy.
std::string without_transport(std::string topic);

// "/cam0/image_raw/compressed" -> "cam0/image_raw", the same for all ways to write the topic of these images.
std::string plain_topic(std::string topic);

// "/cam0/image_raw/compressed" -> "/cam0", where the calibration of its camera is as well.
std::string namespace_of(std::string topic);

// "/stereo/left/image_raw" -> "stereo_left"; "/image" -> "image".
std::string camera_name(const std::string& topic);

// Returns true if images of this topic are rectified, so that P describes them instead of K and D.
bool is_rectified(const std::string& topic);

}  // namespace bslam::dataset
