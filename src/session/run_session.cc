#include "session/run_session.h"

#include <chrono>
#include <thread>

#include "io/atomic_file.h"
#include "io/config_file.h"
#include "io/image_file.h"
#include "io/trajectory_file.h"
#include "report/run_plot.h"
#include "report/summary.h"
#include "report/trajectory_plot.h"
#include "session/frame_source.h"
#include "session/record_builder.h"
#include "system/stopwatch.h"
#include "system/system.h"

namespace bslam::session {
namespace {

constexpr std::size_t kReadAhead = 4;  // frames

// The recorded pace: when each frame is due, from when the first was.
class Metronome {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Metronome(TimeNs first_ns) : first_ns_(first_ns), start_(Clock::now()) {}
  Clock::time_point due(TimeNs time_ns) const { return start_ + std::chrono::nanoseconds(time_ns - first_ns_); }
  void wait_for(TimeNs time_ns) const { std::this_thread::sleep_until(due(time_ns)); }
  bool is_past(TimeNs time_ns) const { return Clock::now() > due(time_ns); }

 private:
  TimeNs first_ns_;
  Clock::time_point start_;
};

bool interrupted(const SessionOptions& options) { return options.interrupted != nullptr && options.interrupted->load(); }

// Feeds the frames one after the other; returns what was fed. Stops early where asked to.
std::vector<InputFrame> feed(const io::Dataset& dataset, const SessionOptions& options, system::System& system) {
  std::vector<InputFrame> inputs;
  FrameSource source(dataset, kReadAhead);
  const Metronome metronome(dataset.frames.front().time_ns);
  for (std::size_t i = 0; i < dataset.frames.size() && !interrupted(options); ++i) {
    const auto item = source.next();
    if (!item) break;
    if (options.pace == Pace::kRealtime) metronome.wait_for(item->images.time_ns);
    const bool late = i + 1 < dataset.frames.size() && metronome.is_past(dataset.frames[i + 1].time_ns);
    const bool drop = options.pace == Pace::kRealtime && options.late == Late::kDrop && late;
    if (!drop) system.process(item->images);
    inputs.push_back({item->images.time_ns, drop, item->read_ms});
    if (options.progress) options.progress(i + 1, dataset.frames.size());
  }
  return inputs;
}

}  // namespace

Result<SessionResult> run_session(const io::Dataset& dataset, const SessionOptions& options) {
  const system::Stopwatch start_up;
  auto masks = io::read_masks(dataset.rig);
  if (!masks) return masks.error();
  system::System system(dataset.rig, options.config, std::move(*masks));
  const double start_up_s = options.start_up_s + 1e-3 * start_up.ms();

  const system::Stopwatch wall;
  const std::vector<InputFrame> inputs = feed(dataset, options, system);
  system.finish();
  SessionResult result;
  result.record = build_record({.dataset = dataset,
                                .config = options.config,
                                .inputs = inputs,
                                .system = system,
                                .complete = inputs.size() == dataset.frames.size(),
                                .start_up_s = start_up_s,
                                .wall_s = 1e-3 * wall.ms()});
  result.trajectory = system.trajectory();
  result.live = system.live_trajectory();
  return result;
}

Status write_outputs(const SessionResult& result, const system::Config& config, const std::filesystem::path& folder) {
  system::Config copy = config;
  const OptionTable table(copy);
  const std::pair<const char*, std::string> files[] = {
      {"trajectory.tum", io::tum_text(result.trajectory, io::trajectory_header("cam0", io::PoseState::kFinal))},
      {"trajectory_live.tum", io::tum_text(result.live, io::trajectory_header("cam0", io::PoseState::kLive))},
      {"config.yaml", io::config_to_yaml(table)},
      {"trajectory.svg", report::trajectory_plot_svg({.title = result.record.data + ": path of camera 0",
                                                      .subtitle = {},
                                                      .estimate = result.trajectory,
                                                      .ground_truth = {},
                                                      .errors = {}})},
      {"run.svg", report::run_plot_svg(result.record)},
      {"summary.json", report::summary_text(result.record)},  // last: where it is, the rest is
  };
  for (const auto& [name, bytes] : files) {
    if (const Status status = io::write_atomically(folder / name, bytes); !status) return status;
  }
  return {};
}

}  // namespace bslam::session
