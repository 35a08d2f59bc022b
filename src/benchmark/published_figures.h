// Published errors of other systems on public sequences, with their sources.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bslam::benchmark {

// Which error a figure is comparable with; see measure_run.h.
enum class Protocol { kP, kT };

// One system's row of a published table: RMSE of the positions in metres, in the order of the suite's sequences. Empty:
// not published, or the system lost track.
struct PublishedRow {
  std::string_view system;
  Protocol protocol;
  std::string_view source;
  bool checked;  // true: compared with the source; false: quoted without comparison
  std::array<std::optional<double>, 11> ate_m;
};

// The errors of one sequence, from the rows that have one for it.
struct PublishedFigure {
  const PublishedRow* row;
  double ate_m;
};

// Returns the figures for a complete sequence with the usual name of its folder: MH_01_easy, MH01 or mh_01 for EuRoC,
// 00 to 10 for KITTI odometry. Returns nothing for other names, such as those of extracts.
std::vector<PublishedFigure> published_figures(std::string_view sequence_name);

}  // namespace bslam::benchmark
