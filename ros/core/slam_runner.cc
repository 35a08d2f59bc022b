#include "core/slam_runner.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <iterator>
#include <utility>

#include "core/diagnostics.h"

namespace bslam_ros {
namespace {

constexpr std::size_t kLoggedEvery = 1000;  // of events that repeat, the first one is logged and then every n-th

std::string describe(const bslam::DroppedImage& image, const bslam::Rig& rig) {
  return rig.camera(image.camera).name + ": image " + std::to_string(image.time_ns) +
         " ns dropped: " + std::string(to_string(image.reason));
}

std::int64_t to_ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

// A file that exists as long as this object.
class TemporaryMap {
 public:
  TemporaryMap() {
    std::error_code error;
    const auto id = std::chrono::steady_clock::now().time_since_epoch().count();
    file_ = std::filesystem::temp_directory_path(error) /
            ("bslam_" + std::to_string(id) + "_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)) + ".bmap");
  }
  ~TemporaryMap() {
    std::error_code error;
    std::filesystem::remove(file_, error);
  }
  TemporaryMap(const TemporaryMap&) = delete;
  TemporaryMap& operator=(const TemporaryMap&) = delete;
  std::string file() const { return file_.string(); }

 private:
  std::filesystem::path file_;
};

}  // namespace

SlamRunner::SlamRunner(const bslam::Rig& rig, const Parameters& parameters, bslam::Config config, Outputs outputs)
    : rig_(rig),
      parameters_(parameters),
      config_(std::move(config)),
      outputs_(std::move(outputs)),
      converter_(rig),
      counts_(rig.size()) {}

bslam::Result<std::unique_ptr<SlamRunner>> SlamRunner::create(const bslam::Rig& rig, const Parameters& parameters,
                                                              Outputs outputs) {
  auto config = parameters.make_config();
  if (!config) return config.error();
  std::unique_ptr<SlamRunner> out(new SlamRunner(rig, parameters, *config, std::move(outputs)));
  const auto localize_only = config->get("localize_only");
  if (!localize_only) return localize_only.error();
  out->localize_only_ = *localize_only == "true";
  auto system = out->make_system(parameters.map_file, out->localize_only_);
  if (!system) return system.error();
  out->system_ = *std::move(system);

  bslam::SyncOptions options;
  options.tolerance_s = parameters.sync_tolerance;
  options.max_wait_s = parameters.max_wait;
  options.max_bundles = static_cast<std::size_t>(parameters.max_bundles);
  options.on_drop = [runner = out.get()](const bslam::DroppedImage& image) { runner->note_drop(image); };
  auto synchronizer = bslam::Synchronizer::create(rig, options);
  if (!synchronizer) return synchronizer.error();
  out->synchronizer_.emplace(*std::move(synchronizer));
  out->thread_ = std::thread([runner = out.get()] { runner->run(); });
  return out;
}

SlamRunner::~SlamRunner() {
  if (const bslam::Status status = stop(); !status) log(bslam::LogLevel::kWarning, status.error().message());
}

bslam::Result<std::shared_ptr<bslam::System>> SlamRunner::make_system(const std::string& map, bool localize_only) {
  bslam::Config config = config_;
  const bslam::Status set = config.set("localize_only", localize_only ? "true" : "false");
  if (!set) return set.error();
  bslam::Startup startup;
  startup.map = map;
  startup.history_frames = static_cast<std::size_t>(parameters_.history_frames);
  startup.callbacks.log = [this](bslam::LogLevel level, std::string_view line) { log(level, std::string(line)); };
  startup.callbacks.map = [this](const bslam::MapView&) { map_changed_ = true; };
  startup.callbacks.loop = [this](const bslam::LoopEvent&) { ++loops_; };
  auto system = bslam::System::create(rig_, config, std::move(startup));
  if (!system) return system.error();
  return std::make_shared<bslam::System>(*std::move(system));
}

bslam::Status SlamRunner::push(std::size_t camera, const RawImage& image, std::int64_t time_ns) {
  auto grey = to_grey(image, time_ns, parameters_.significant_bits);
  const bslam::Status status = grey ? synchronizer_->push(camera, *grey) : bslam::Status(grey.error());
  if (!status) reject(camera, status.error());
  return status;
}

void SlamRunner::reject(std::size_t camera, const bslam::Error& error) {
  bool is_new = false;
  const std::string message = error.message();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (camera >= counts_.size()) return;
    ++counts_[camera].rejected;
    is_new = std::exchange(counts_[camera].last_error, message) != message;
  }
  if (is_new) log(bslam::LogLevel::kWarning, rig_.camera(camera).name + ": image rejected: " + message);
}

// Logs the first image of each camera and reason, and then every thousandth one.
void SlamRunner::note_drop(const bslam::DroppedImage& image) {
  std::size_t count = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    count = ++counts_[image.camera].dropped[static_cast<std::size_t>(image.reason)];
  }
  if (count > 1 && count % kLoggedEvery != 0) return;
  log(bslam::LogLevel::kWarning,
      describe(image, rig_) + (count == 1 ? "; further ones are counted" : ", " + std::to_string(count) + " so far"));
}

void SlamRunner::run() {
  while (const auto images = synchronizer_->wait()) {
    try {
      take_over();
      if (process(*images)) last_warning_.clear();
    } catch (const std::exception& error) {  // of an output, or for lack of memory; the next frame may succeed
      note_failure(error.what());
    }
  }
}

// The outputs of a node may throw, such as when ROS shuts down. No exception may leave the thread.
void SlamRunner::note_failure(const std::string& what) {
  const std::string text = "a frame was not processed or not published: " + what;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = text;
  }
  try {
    warn(text);
  } catch (const std::exception&) {  // the diagnostics have it
  }
}

// Logs a failure of a frame, but not again for each of the frames that follow: what differs in its numbers is the same.
void SlamRunner::warn(const std::string& text) {
  std::string words;
  std::copy_if(text.begin(), text.end(), std::back_inserter(words), [](char c) { return c < '0' || c > '9'; });
  const bool is_new = std::exchange(last_warning_, words) != words;
  num_same_warnings_ = is_new ? 0 : num_same_warnings_ + 1;
  if (num_same_warnings_ % kLoggedEvery == 0) log(bslam::LogLevel::kWarning, text);
}

// Continues with the System that a service has made.
void SlamRunner::take_over() {
  std::shared_ptr<bslam::System> before;  // destroyed without the lock
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!next_system_) return;
    before = std::exchange(system_, std::exchange(next_system_, nullptr));
    localize_only_ = next_localize_only_;
    failure_.clear();
  }
  keep_trajectory(*before);
  converter_.restart();
  cloud_due_ = true;
}

// The map of the System is gone with it, and with the map the corrections of the poses that are to come.
void SlamRunner::keep_trajectory(const bslam::System& before) {
  if (parameters_.trajectory_file.empty()) return;
  auto trajectory = before.trajectory(bslam::RigFrame::kBody);
  if (!trajectory) return log(bslam::LogLevel::kWarning, trajectory.error().message());
  if (!trajectory->empty()) earlier_.push_back(*std::move(trajectory));
}

// Returns false if the frame was refused.
bool SlamRunner::process(const bslam::ImageBundle& images) {
  const auto frame = system_->process(images);  // only this thread replaces system_
  std::optional<bslam::FrameResult> before;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_frame_at_ = Clock::now();
    failure_ = frame ? "" : frame.error().message();
    if (frame) {
      before = std::exchange(last_, *frame);
      ++frames_;
      if (!frame->tracking()) ++lost_;
    }
  }
  if (!frame) {
    warn(frame.error().message());
    return false;
  }
  if (frame->tracking() && outputs_.pose) outputs_.pose(converter_.convert(*frame));
  report_changes(before, *frame);
  if (map_changed_.exchange(false)) cloud_due_ = true;
  if (!frame->tracking()) return true;
  publish_cloud(*frame);
  publish_path(*frame);
  return true;
}

void SlamRunner::report_changes(const std::optional<bslam::FrameResult>& before, const bslam::FrameResult& now) {
  bool changed = !before || before->status != now.status || before->reason != now.reason || before->scale != now.scale;
  for (std::size_t c = 0; !changed && c < now.cameras.size(); ++c)
    changed = before->cameras[c].state != now.cameras[c].state || before->cameras[c].reason != now.cameras[c].reason;
  if (before && before->tracking() && now.tracking() && before->submap != now.submap) {
    changed = true;
    log(bslam::LogLevel::kWarning, "the map frame has changed: these poses belong to submap " +
                                       std::to_string(now.submap) + ", those before to " +
                                       std::to_string(before->submap));
  }
  if (changed && outputs_.diagnostics) outputs_.diagnostics(diagnostics());
}

// The landmarks of the submap of the present pose: those of other submaps are in frames that are unrelated to it.
void SlamRunner::publish_cloud(const bslam::FrameResult& frame) {
  if (!outputs_.cloud) return;
  const std::size_t subscribers = outputs_.cloud_subscribers ? outputs_.cloud_subscribers() : 1;
  if (subscribers > std::exchange(cloud_subscribers_, subscribers)) cloud_due_ = true;  // a new one has no points yet
  const bool early = cloud_published_ && frame.time_ns - cloud_ns_ < to_ns(parameters_.cloud_period);
  if (!cloud_due_ || early || subscribers == 0) return;
  cloud_due_ = false;
  cloud_published_ = true;
  cloud_ns_ = frame.time_ns;
  PointCloud out;
  out.time_ns = frame.time_ns;
  for (const auto& landmark : system_->map().landmarks()) {
    if (landmark.submap != frame.submap || landmark.observations < parameters_.cloud_min_observations) continue;
    const auto p = converter_.to_map(landmark.position);
    out.points.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
                          static_cast<float>(landmark.observations)});
  }
  outputs_.cloud(out);
}

// The trajectory that ends with the present frame, in the present map.
void SlamRunner::publish_path(const bslam::FrameResult& frame) {
  const bool early = path_published_ && frame.time_ns - path_ns_ < to_ns(parameters_.path_period);
  if (early || !outputs_.path || (outputs_.wants_path && !outputs_.wants_path())) return;
  path_published_ = true;
  path_ns_ = frame.time_ns;
  const auto all = system_->trajectories(bslam::RigFrame::kBody);
  if (!all) return;
  PathOutput out;
  out.time_ns = frame.time_ns;
  for (const bslam::Trajectory& part : *all) {
    if (part.empty() || part.back().time_ns != frame.time_ns) continue;
    const std::size_t most = static_cast<std::size_t>(parameters_.path_max_poses);
    const std::size_t step = (part.size() + most - 1) / most;
    for (std::size_t i = (part.size() - 1) % step; i < part.size(); i += step)  // ends with the last one
      out.poses.emplace_back(part[i].time_ns, converter_.to_map(part[i].T_world_frame));
  }
  outputs_.path(out);
}

bslam::Status SlamRunner::save_map(const std::string& file) {
  if (file.empty()) return bslam::Error{"save_map", "file", "no name", "the name of the file to write"};
  std::shared_ptr<bslam::System> system;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    system = next_system_ ? next_system_ : system_;
  }
  return system->save_map(file);
}

bslam::Status SlamRunner::load_map(const std::string& file, bool localize_only) {
  if (file.empty()) return bslam::Error{"load_map", "file", "no name", "the name of a saved map"};
  const std::lock_guard<std::mutex> replacement(replacement_);
  return replace_system(file, localize_only);
}

bslam::Status SlamRunner::set_localize_only(bool on) {
  const std::lock_guard<std::mutex> replacement(replacement_);
  std::shared_ptr<bslam::System> system;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if ((next_system_ ? next_localize_only_ : localize_only_) == on) return {};
    system = next_system_ ? next_system_ : system_;
  }
  if (system->map().num_keyframes() == 0)
    return bslam::Error{"localize_only", "", "no map yet", "a map to localise in"};
  const TemporaryMap map;
  if (const bslam::Status saved = system->save_map(map.file()); !saved) return saved;
  return replace_system(map.file(), on);
}

bslam::Status SlamRunner::replace_system(const std::string& map, bool localize_only) {
  auto system = make_system(map, localize_only);
  if (!system) return system.error();
  std::shared_ptr<bslam::System> unused;  // destroyed without the lock: its threads have to end first
  const std::lock_guard<std::mutex> lock(mutex_);
  unused = std::exchange(next_system_, *std::move(system));
  next_localize_only_ = localize_only;
  return {};
}

std::vector<DiagnosticStatus> SlamRunner::diagnostics() const {
  Report report;
  std::shared_ptr<bslam::System> system;
  const bslam::SyncCounts counts = synchronizer_->counts();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    system = system_;
    report.last = last_;
    report.failure = failure_;
    report.seconds_silent = std::chrono::duration<double>(Clock::now() - last_frame_at_).count();
    report.localize_only = localize_only_;
    report.frames = frames_;
    report.lost = lost_;
    for (std::size_t c = 0; c < counts_.size(); ++c)
      report.cameras.push_back(
          {rig_.camera(c).name, counts.pushed[c], counts_[c].rejected, counts_[c].last_error, counts.dropped[c]});
  }
  const bslam::MapView map = system->map();
  report.loops = loops_;
  report.keyframes = map.num_keyframes();
  report.landmarks = map.num_landmarks();
  return to_diagnostics(report);
}

bslam::Status SlamRunner::stop() {
  if (std::exchange(stopped_, true)) return {};
  if (!synchronizer_) return {};
  if (const bslam::Status closed = synchronizer_->close(); !closed)
    log(bslam::LogLevel::kWarning, closed.error().message());
  if (thread_.joinable()) thread_.join();
  return parameters_.trajectory_file.empty() ? bslam::Status() : write_trajectories();
}

bslam::Status SlamRunner::write_trajectories() {
  for (std::size_t i = 0; i < earlier_.size(); ++i) {
    const std::string file = earlier_trajectory_file(parameters_.trajectory_file, i + 1);
    if (const bslam::Status written = write_trajectory(file, earlier_[i]); !written) return written;
  }
  // The adjustment of a large map may take longer than a launched node is given to end.
  if (const bslam::Status written = write_present_trajectory(); !written) return written;
  if (const bslam::Status finished = system_->finish(); !finished) return finished;
  return write_present_trajectory();
}

bslam::Status SlamRunner::write_present_trajectory() const {
  const auto trajectory = system_->trajectory(bslam::RigFrame::kBody);
  if (!trajectory) return trajectory.error();
  return write_trajectory(parameters_.trajectory_file, *trajectory);
}

bslam::Status SlamRunner::write_trajectory(const std::string& file, bslam::Trajectory trajectory) const {
  for (bslam::TimedPose& pose : trajectory) pose.T_world_frame = converter_.to_map(pose.T_world_frame);
  return bslam::write_tum(file, trajectory, bslam::RigFrame::kBody, parameters_.map_frame);
}

void SlamRunner::log(bslam::LogLevel level, const std::string& line) const {
  if (outputs_.log) outputs_.log(level, line);
}

}  // namespace bslam_ros
