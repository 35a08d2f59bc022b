#include "cli/python_package.h"

#include <cstdlib>

namespace bslam::cli {

std::string python_interpreter() {
  const char* chosen = std::getenv("BSLAM_PYTHON");
  return chosen != nullptr && *chosen != 0 ? chosen : "python3";
}

std::string python_code(const std::string& statements) {
  return "import sys; sys.path[:] = [folder for folder in sys.path if folder]; " + statements;
}

}  // namespace bslam::cli
