// Looks at a few images of a recording before it is used. Internal to this folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/camera.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// Checks that one of the first readable images of a camera has the calibrated resolution. Errors: another resolution;
// no image exists; none of those that were tried, which are the first ones and others spread over the recording, can
// be read.
Status check_images(const std::vector<image_files::ImageFile>& images, const camera::Camera& camera);

// Adds a warning that is not there yet.
void add_once(const std::string& warning, std::vector<std::string>& warnings);

// Text for messages: the ratio of the image size to the calibrated resolution, if the aspect ratio is the same but the
// size differs; otherwise empty.
std::string resolution_hint(int width, int height, const camera::Camera& camera);

// Returns a message with the number of listed images that do not exist and the first of them; nullopt if none or all
// are missing.
std::optional<std::string> absent_warning(const std::vector<image_files::ImageFile>& images);

// Returns a warning if two series of images, each with the usual interval, alternate in a part of the recording. This
// happens if the clock was set back: file names that are time stamps then do not show the order of capture. Otherwise
// nullopt.
std::optional<std::string> interleaved_warning(const std::vector<image_files::ImageFile>& images);

// Checks that no two cameras have the same images: several of their first ones in a row, except those of one value
// everywhere, which may be equal by chance.
Status check_different_images(const std::vector<std::vector<image_files::ImageFile>>& images);

// Tries to decode a few images spread over the recording. Returns a note with the number of images that cannot be
// decoded and the first of them; nullopt if there are none.
std::optional<std::string> unreadable_note(const std::vector<image_files::ImageFile>& images);

}  // namespace bslam::dataset
