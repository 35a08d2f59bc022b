#include "base/interrupted.h"

namespace bslam {

Status not_interrupted(const std::stop_token& interrupted) {
  if (!interrupted.stop_requested()) return {};
  return Error{"", "", "an interruption", "the end of the command", "interrupted; nothing is written"};
}

}  // namespace bslam
