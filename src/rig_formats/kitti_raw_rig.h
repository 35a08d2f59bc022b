// Reads calib_cam_to_cam.txt of KITTI raw (Geiger et al., IJRR 2013).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads cameras 00 to 03. The file describes two rigs: the raw cameras (S, K, D and R, T: reference camera to camera)
// and the rectified ones (S_rect, P_rect). Which of them is read depends on the images in the same folder, if their
// size is S or S_rect; otherwise on a folder in the path or next to the file whose name ends in _extract (raw) or _sync
// (rectified); otherwise the rectified cameras are read. A note reports the choice. The body frame is camera 00 of the
// chosen rig.
Result<camera::RigReading> read_kitti_raw_rig(const std::filesystem::path& file, const std::string& text);

}  // namespace bslam::rig_formats
