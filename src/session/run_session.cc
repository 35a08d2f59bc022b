#include "session/run_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/atomic_file.h"
#include "base/stopwatch.h"
#include "base/work.h"
#include "evaluation/trajectory_file.h"
#include "image_decoding/image_file.h"
#include "report/trajectory_plot.h"
#include "rig_formats/bslam_rig.h"
#include "session/covariance_file.h"
#include "session/frame_source.h"
#include "session/load_control.h"
#include "session/memory_report.h"
#include "session/process_use.h"
#include "session/record_builder.h"
#include "session/report_data.h"
#include "session/run_plot.h"
#include "session/summary.h"
#include "session/trajectory_comments.h"
#include "system/system.h"
#include "yaml/config_file.h"

namespace bslam::session {
namespace {

constexpr std::size_t kReadAhead = 6;  // frames: they are read while a keyframe is mapped

// A frame of the recorded run and its level of reduction.
struct RecordedFrame {
  FrameId frame;
  int reduction = 0;
};

// In order. There are fewer than in the data set if the run was interrupted or dropped frames.
std::vector<RecordedFrame> recorded_frames(const execution::Journal& journal) {
  std::vector<RecordedFrame> frames;
  int reduction = 0;
  for (const execution::JournalEntry& e : journal.entries) {
    if (e.step == execution::JournalStep::kReduce) reduction = e.input;
    if (e.step == execution::JournalStep::kFrame) frames.push_back({FrameId(e.input), reduction});
  }
  return frames;
}

// Passes a frame and its images on to the observer of the run.
void report_frame(RunObserver& observer, FrameSource::Item&& item, system::FrameRecord&& record,
                  system::System& system) {
  observer.processed({std::move(item.images), std::move(record), system.take_observed_keypoints(), system.snapshot(),
                      system.first_camera(), item.read_ms},
                     system);
}

// The frames that were fed, and whether they are all frames of the run.
struct Fed {
  std::vector<InputFrame> inputs;
  bool all = false;
  std::size_t read_ahead_bytes = 0;  // maximum memory of the frames read in advance
};

// Maximum delay of a frame, in seconds, at a recorded pace with Late::kDrop. A frame is dropped if its delay is larger
// and the next frame is already due; if it has not been read yet, it is not read.
constexpr double kMaxLateness_s = 0.2;

// At a recorded pace with Late::kDrop, and for live cameras: decides which frames are dropped in addition to those that
// the source has dropped, and the level of reduced work of the others.
class FrameChoice {
 public:
  explicit FrameChoice(const SessionOptions& options)
      : options_(options),
        reduces_((options.late == Late::kDrop || options.source) && options.config.mode == execution::Mode::kParallel) {
    if (options.replay) recorded_ = recorded_frames(*options.replay);
  }
  // Returns true if the replayed run had ended before this frame.
  bool is_after_replay(const FrameSource::Item& item) const {
    return options_.replay && (recorded_.empty() || recorded_.back().frame < item.images.id);
  }
  // The level of reduction of the frame; nullopt if it is dropped.
  std::optional<int> reduction(const FrameSource::Item& item, const RunControl& control) {
    if (options_.replay) return recorded_reduction(item.images.id);
    const double late_s = control.lateness_s(item.images.time_ns);
    double behind = static_cast<double>(item.waiting);
    if (item.next_ns) behind = late_s / std::max(kMinInterval_s, to_seconds(*item.next_ns - item.images.time_ns));
    const int level = reduces_ ? load_.update(behind, std::max(late_s, item.waiting_s), item.images.time_ns) : 0;
    const bool drops = options_.late == Late::kDrop && item.waiting > 0 && behind > 1 && late_s > kMaxLateness_s;
    return drops ? std::nullopt : std::optional(level);
  }

 private:
  static constexpr double kMinInterval_s = 1e-3;

  std::optional<int> recorded_reduction(FrameId frame) const {
    const auto found = std::ranges::lower_bound(recorded_, frame, {}, &RecordedFrame::frame);
    if (found == recorded_.end() || found->frame != frame) return std::nullopt;
    return found->reduction;
  }

  const SessionOptions& options_;
  const bool reduces_;
  LoadControl load_;
  std::vector<RecordedFrame> recorded_;
};

// Feeds the frames to the system in order. Stops early if the run is interrupted.
Result<Fed> feed(FrameSource& source, std::size_t count, const SessionOptions& options, RunControl& control,
                 system::System& system) {
  Fed fed;
  FrameChoice choice(options);
  while (!options.interrupted.stop_requested()) {
    auto item = source.next();
    fed.all = !item;
    if (!item || choice.is_after_replay(*item)) break;
    if (!item->dropped && !control.wait_for(item->images.time_ns, options.interrupted)) break;
    const std::optional<int> reduction = choice.reduction(*item, control);
    const bool drop = item->dropped || !reduction;
    fed.inputs.push_back({item->images.time_ns, drop, item->read_ms});
    if (drop) {
      if (options.observer) options.observer->dropped(item->images.time_ns, item->read_ms);
    } else {
      system.set_reduction(*reduction);
      auto processed = system.process(item->images);
      if (!processed) return processed.error();
      if (options.observer) report_frame(*options.observer, *std::move(item), *std::move(processed), system);
    }
    if (options.progress) options.progress(fed.inputs.size(), count);
  }
  fed.read_ahead_bytes = source.largest_bytes();
  if (options.observer) options.observer->fed();
  return fed;
}

Result<Fed> feed(const dataset::Dataset& dataset, const SessionOptions& options, system::System& system) {
  RunControl recorded_pace(options.pace == Pace::kRealtime ? 1.0 : 0.0);
  RunControl& control = options.control ? *options.control : recorded_pace;
  if (options.source) return feed(*options.source, 0, options, control, system);
  const bool sequential = options.config.mode == execution::Mode::kSequential;
  std::function<bool(TimeNs, TimeNs)> skips;
  if (options.late == Late::kDrop && !options.replay) {
    skips = [&control](TimeNs time_ns, TimeNs next_ns) {
      return control.lateness_s(time_ns) > std::max(kMaxLateness_s, to_seconds(next_ns - time_ns));
    };
  }
  DatasetFrames source(dataset, kReadAhead, sequential ? ReaderPriority::kLow : ReaderPriority::kNormal, skips);
  return feed(source, dataset.frames.size(), options, control, system);
}

}  // namespace

namespace {

// Returns the calibration of all cameras, with that of `found`, as it is at the end, for the cameras in use.
camera::Rig with_refined_calibration(const camera::Rig& found, const dataset::Dataset& dataset) {
  const camera::Rig last = found.after_moves();
  return dataset.whole_rig ? dataset.whole_rig->with_calibration_of(last, dataset.cameras_used) : last;
}

// The map at the end of the run, without metric scale if the scale is meaningless.
map::MapSnapshot map_of(const system::System& system, const RunRecord& record) {
  const map::MapSnapshot map = system.snapshot();
  if (!record.calibration.scale_unfounded || map->scale() != map::Scale::kMetric) return map;
  map::BundledMap copy = *map;
  copy.set_scale(map::Scale::kUnobservable);
  return std::make_shared<const map::BundledMap>(std::move(copy));
}

// Resources that a run has used between the construction of the system and its end.
struct Used {
  double wall_s = 0;
  std::optional<double> cpu_s;
  WorkRecord work;
};

class Use {
 public:
  explicit Use(const SessionOptions& options) : options_(options), allocations_(allocations()) {}

  Used so_far() const {
    const WorkCounts work = work_so_far() - work_;
    Used used{.wall_s = 1e-3 * wall_.ms(),
              .cpu_s = cpu_seconds(),
              .work = {.images = static_cast<std::int64_t>(work.images),
                       .keypoints = static_cast<std::int64_t>(work.keypoints),
                       .solver_steps = static_cast<std::int64_t>(work.solver_steps)}};
    if (used.cpu_s && cpu_s_) *used.cpu_s -= *cpu_s_;
    if (options_.allocations) used.work.allocations = allocations() - allocations_;
    return used;
  }

 private:
  std::int64_t allocations() const {
    return options_.allocations ? static_cast<std::int64_t>(options_.allocations()) : 0;
  }

  const SessionOptions& options_;
  const Stopwatch wall_;
  const std::optional<double> cpu_s_ = cpu_seconds();
  const WorkCounts work_ = work_so_far();
  const std::int64_t allocations_;
};

Result<Fed> run_to_end(const dataset::Dataset& dataset, const SessionOptions& options, system::System& system) {
  try {
    const std::stop_callback on_interruption(options.interrupted, [&system] { system.interrupt(); });
    auto fed = feed(dataset, options, system);
    if (fed) system.finish();
    return fed;
  } catch (const execution::ReplayMismatch& mismatch) {
    return mismatch.error;
  }
}

// Frames that come in real time do not wait.
system::Config config_for(const SessionOptions& options) {
  system::Config config = options.config;
  const bool in_real_time = options.pace == Pace::kRealtime && options.late == Late::kDrop;
  if (options.source || in_real_time) {
    config.execution.await_calibration = false;
    config.execution.await_mapping_s = 0.0;
  }
  return config;
}

// The memory of the parts of a run at its end. After an interruption, stages may still be running.
void measure_memory(const SessionOptions& options, const system::System& system, const Fed& fed,
                    SessionResult& result) {
  if (!options.memory_report || options.interrupted.stop_requested()) return;
  result.record.memory = memory_report({.system = system,
                                        .vocabulary = options.vocabulary.get(),
                                        .record = result.record,
                                        .journal = result.journal,
                                        .trajectories = {&result.trajectories, &result.live},
                                        .read_ahead_bytes = fed.read_ahead_bytes});
}

}  // namespace

Result<SessionResult> run_session(const dataset::Dataset& dataset, const SessionOptions& options) {
  const Stopwatch start_up;
  auto masks = image_decoding::read_masks(dataset.rig);
  if (!masks) return masks.error();
  system::System system(dataset.rig, config_for(options),
                        {std::move(*masks), options.vocabulary, options.map, options.initial_rig, options.replay});
  const double start_up_s = options.start_up_s + 1e-3 * start_up.ms();

  const Use use(options);
  const Result<Fed> fed = run_to_end(dataset, options, system);
  if (!fed) return fed.error();
  const Used used = use.so_far();
  SessionResult result;
  result.trajectories = system.trajectories();
  result.live = system.live_trajectories();
  result.record = build_record({.dataset = dataset,
                                .config = options.config,
                                .inputs = fed->inputs,
                                .system = system,
                                .trajectories = result.trajectories,
                                .replayed = options.replay.has_value(),
                                .loaded = options.map.has_value(),
                                .complete = fed->all && !options.interrupted.stop_requested(),
                                .start_up_s = start_up_s,
                                .wall_s = used.wall_s},
                               system.take_frames());
  result.record.cpu_s = used.cpu_s;
  result.record.work = used.work;
  result.map = map_of(system, result.record);
  result.rig = system.rig();
  result.calibration = system.calibration();
  if (result.record.calibration.refined) result.refined_rig = with_refined_calibration(*result.rig, dataset);
  result.refined_topics = dataset.rig_topics;
  result.journal = system.journal();
  measure_memory(options, system, *fed, result);
  return result;
}

namespace {

using Files = std::vector<std::pair<std::string, std::string>>;  // name and content

std::vector<KeyframeId> roots_of(const SessionResult& result) {
  return result.map ? result.map->roots() : std::vector<KeyframeId>();
}

// Adds one file per submap. The file of the first submap is written even if there is no submap.
void add_trajectories(const SessionResult& result, const std::vector<system::SubmapTrajectory>& submaps,
                      const std::string& stem, evaluation::PoseState state, Files& files) {
  const std::vector<KeyframeId> roots = roots_of(result);
  for (std::size_t i = 0; i < std::max<std::size_t>(submaps.size(), 1); ++i) {
    evaluation::Trajectory poses = submaps.empty() ? evaluation::Trajectory() : submaps[i].poses;
    std::string comments = trajectory_comments(result.record, submaps, i, state, roots);
    if (result.subtracted_ns) {
      for (evaluation::TimedPose& pose : poses) pose.time_ns -= *result.subtracted_ns;
      comments += "\n# " + evaluation::image_stamp_comment();
    }
    files.emplace_back(trajectory_file(stem, i), evaluation::tum_text(poses, comments));
  }
}

// The landmarks in the submap of trajectory.tum.
std::vector<Eigen::Vector3d> landmarks_of_path(const SessionResult& result) {
  std::vector<Eigen::Vector3d> out;
  if (result.trajectories.empty() || !result.map) return out;
  const std::vector<KeyframeId> root = result.map->root_of_each();
  for (const LandmarkId l : result.map->landmark_ids()) {
    const map::Landmark& landmark = result.map->landmark(l);
    if (root[landmark.reference.keyframe.index()] == result.trajectories.front().root) out.push_back(landmark.position);
  }
  return out;
}

// Names the submap that trajectory.svg shows, and the files of the others.
std::string submap_text(const SessionResult& result) {
  const std::size_t n = result.trajectories.size();
  if (n < 2) return {};
  const system::SubmapTrajectory& shown = result.trajectories.front();
  return fmt::format("submap {}, one of {}, {} poses; the others, each in its own world frame, are in {}{}",
                     submap_number(shown.root, roots_of(result)).value_or(0), n, shown.poses.size(),
                     trajectory_file("trajectory", 1),
                     n > 2 ? fmt::format(" to {}", trajectory_file("trajectory", n - 1)) : "");
}

// The plots, which are large, are written last: if the disk is full, the results are more important.
Files output_files(const SessionResult& result, const system::Config& config) {
  system::Config copy = config;
  const OptionTable table(copy);
  Files files;
  files.emplace_back("summary.json", summary_text(result.record));
  add_trajectories(result, result.trajectories, "trajectory", evaluation::PoseState::kFinal, files);
  add_trajectories(result, result.live, "trajectory_live", evaluation::PoseState::kLive, files);
  files.emplace_back("covariance_live.csv", covariance_text(result.record, result.subtracted_ns.value_or(0)));
  files.emplace_back("config.yaml", yaml::config_to_yaml(table));
  if (result.refined_rig)
    files.emplace_back("rig_refined.yaml", rig_formats::rig_to_yaml(*result.refined_rig, result.refined_topics));
  const evaluation::Trajectory path =
      result.trajectories.empty() ? evaluation::Trajectory() : result.trajectories.front().poses;
  files.emplace_back("trajectory.svg", report::trajectory_plot_svg({.title = result.record.data + ": path of camera 0",
                                                                    .subtitle = submap_text(result),
                                                                    .estimate = path,
                                                                    .ground_truth = {},
                                                                    .errors = {},
                                                                    .axes = report::WorldAxes::kCamera,
                                                                    .landmarks = landmarks_of_path(result)}));
  files.emplace_back("run.svg", run_plot_svg(result.record));
  return files;
}

}  // namespace

std::vector<Error> write_outputs(const SessionResult& result, const system::Config& config,
                                 const std::filesystem::path& folder, const std::optional<ReportSource>& report) {
  std::vector<Error> failures;
  const auto write = [&](const std::string& name, const std::string& bytes) {
    if (const Status status = write_atomically(folder / name, bytes); !status) failures.push_back(status.error());
  };
  for (const auto& [name, bytes] : output_files(result, config)) write(name, bytes);
  if (report) write("report.html", report_page(result, config, *report));
  return failures;
}

}  // namespace bslam::session
