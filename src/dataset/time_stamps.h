// The unit of recorded time stamps: nanoseconds unless the request names another unit or the frame rate of numbered
// images.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/timestamp.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

struct TimeStampOptions {
  std::optional<double> rate_hz = {};  // time stamps are image numbers; images are taken at this rate
  std::optional<TimeNs> unit_ns = {};  // length of one unit of the time stamps; nullopt: 1 ns, which is checked
};

// Converts the time stamps of a camera, as read from its files, to nanoseconds. Errors: the rate or unit is not
// positive or both are given; a converted time is out of range; no unit is given and the median interval between images
// is shorter than half a millisecond, so that the time stamps are hardly nanoseconds. The error proposes the options.
// `source` is the file or folder of the time stamps.
Status convert_time_stamps(const TimeStampOptions& options, const std::string& source,
                           std::vector<image_files::ImageFile>& images);

}  // namespace bslam::dataset
