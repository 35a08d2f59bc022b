#include "session/covariance_file.h"

#include <fmt/format.h>

#include <iterator>

namespace bslam::session {

std::string covariance_text(const RunRecord& record, TimeNs subtracted_ns) {
  std::string text =
      "# time [ns], upper triangle of the covariance of T_world_cam0: rotation [rad], translation [m], axes of camera "
      "0\n";
  for (const RunFrame& frame : record.frames) {
    if (!frame.record || !frame.record->result.covariance) continue;
    const geometry::Matrix6d& covariance = *frame.record->result.covariance;
    fmt::format_to(std::back_inserter(text), "{}", frame.record->result.time_ns - subtracted_ns);
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column)
        fmt::format_to(std::back_inserter(text), ",{:.6e}", covariance(row, column));
    }
    text += '\n';
  }
  return text;
}

}  // namespace bslam::session
