#include <cstdio>

#include "cli/verbs.h"

namespace bslam::cli {

int report_error(const Error& error) {
  std::fprintf(stderr, "bslam: %s\n", error.message().c_str());
  return kExitBadInput;
}

}  // namespace bslam::cli
