// The Python package, which carries out some commands.
#pragma once

#include <string>

namespace bslam::cli {

// python3, or $BSLAM_PYTHON.
std::string python_interpreter();

// Code that is run with -c. Packages in the current folder, which -c would prefer, are not looked for.
std::string python_code(const std::string& statements);

}  // namespace bslam::cli
