// Runs the commands that are implemented in the Python package.
#pragma once

#include <string>

namespace bslam::cli {

// python3, or $BSLAM_PYTHON.
std::string python_interpreter();

// Returns code to be run by python3 -c. The code does not import packages from the current folder, which -c would
// otherwise prefer.
std::string python_code(const std::string& statements);

}  // namespace bslam::cli
