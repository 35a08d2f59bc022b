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

// For messages, if images have the shape but not the size of those that are calibrated: which part of the resolution
// they have. Empty otherwise.
std::string resolution_hint(int width, int height, const camera::Camera& camera);

// Says how many images are listed but not there, and which is the first; nullopt if none are missing, or all.
std::optional<std::string> absent_warning(const std::vector<image_files::ImageFile>& images);

// Warns of a part of the recording in which two series of images, each of the usual interval, alternate: names that are
// time stamps do not tell the order in which images were taken if the clock was set back. nullopt if there is none.
std::optional<std::string> interleaved_warning(const std::vector<image_files::ImageFile>& images);

// Checks that no two cameras have the same images: several of their first ones in a row, except those of one value
// everywhere, which may be equal by chance.
Status check_different_images(const std::vector<std::vector<image_files::ImageFile>>& images);

// Tries to decode a few images spread over the recording. Returns a note that says how many cannot be decoded, and
// which is the first; nullopt if all can.
std::optional<std::string> unreadable_note(const std::vector<image_files::ImageFile>& images);

}  // namespace bslam::dataset
