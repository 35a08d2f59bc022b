// The unit of recorded time stamps: nanoseconds unless the request names another unit or the frame rate of numbered
// images.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// Nanoseconds; time offsets can be added and differences taken without overflow, and maps can store it.
constexpr TimeNs kMaxTime = 4'000'000'000'000'000'000;
// Median intervals between the images of a camera that are outside of these bounds are those of another unit.
constexpr TimeNs kShortestInterval = 500'000;        // nanoseconds; cameras of 2 kHz
constexpr TimeNs kLongestInterval = 20'000'000'000;  // nanoseconds

struct TimeStampOptions {
  std::optional<double> rate_hz = {};  // time stamps are image numbers; images are taken at this rate
  std::optional<TimeNs> unit_ns = {};  // length of one unit of the time stamps; nullopt: 1 ns, which is checked
};

// Returns false if the median interval is so short that time stamps are hardly nanoseconds.
bool are_nanoseconds(std::span<const TimeNs> stamps);

// Converts the time stamps of a camera, as read from its files, to nanoseconds. Errors: the rate or unit is not
// positive or both are given; a converted time is out of range; the median interval between images is shorter than half
// a millisecond, so that the time stamps have hardly the unit that is given, or are hardly nanoseconds if none is
// given; or it is longer than 20 s in the unit that is given. Nanoseconds that are given are not checked. The error
// proposes the options. `source` is the file or folder of the time stamps.
Status convert_time_stamps(const TimeStampOptions& options, const std::string& source,
                           std::vector<image_files::ImageFile>& images);

}  // namespace bslam::dataset
