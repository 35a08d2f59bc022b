// Text files with the times of images: one time per line, or lines of TIME FILENAME.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"

namespace bslam::dataset {

struct TimeList {
  std::filesystem::path file;
  std::vector<TimeNs> times_ns;
  std::vector<std::string> names;  // one per time, or none
  bool in_seconds = true;          // else whole nanoseconds, or whole numbers of the unit that is given
};

// Returns the file with the times of a folder of images: times.txt, timestamps.txt, the same with .csv, data.csv or
// FOLDER.txt in it; then FOLDER.txt or FOLDER.csv, and then times.txt and the like in the folder `data` of the
// recording; nullopt if there is none. Errors: two of them in one place.
Result<std::optional<std::filesystem::path>> find_time_list(const std::filesystem::path& folder,
                                                            const std::filesystem::path& data);

// Reads lines of seconds with a decimal point or an exponent, or of whole nanoseconds, each with or without the name of
// an image behind it (TUM: "TIME NAME"; EuRoC: "TIME,NAME"). Empty lines, lines that begin with # and the first line of
// a csv file if it begins with no number are ignored. Errors: a line of another kind; whole numbers that are no
// nanoseconds, since their unit is unknown; seconds that are less than half a millisecond or more than 20 s apart.
// `unit_is_given`: whole numbers have another unit, which the caller applies and checks; seconds are an error.
Result<TimeList> read_time_list(const std::filesystem::path& file, bool unit_is_given = false);

}  // namespace bslam::dataset
