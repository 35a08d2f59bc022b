// The file of a plot that is asked for by name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace bslam::report {

// Checks, before the work, whether a plot can be written to this file: its name ends in .svg or has no extension, it is
// none of the files that are read, and an existing file is a plot. Errors name `asked_by`, such as the command line,
// and the option.
Status check_plot_file(const std::filesystem::path& file, const std::string& asked_by, const char* option,
                       const std::vector<std::filesystem::path>& inputs);

}  // namespace bslam::report
