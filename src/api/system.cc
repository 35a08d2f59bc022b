#include "system/system.h"

#include <bslam/system.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <utility>

#include "api/access.h"
#include "api/bundle_reader.h"
#include "api/calibration_report.h"
#include "api/config_impl.h"
#include "api/conversions.h"
#include "api/frame_conversion.h"
#include "api/guard.h"
#include "api/map_view_impl.h"
#include "api/notifier.h"
#include "api/rig_impl.h"
#include "base/output_file.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"
#include "system/cameras_of_run.h"

namespace bslam {
namespace {

// Tries, without waiting, to become the only running call of a System; converts to false if another call is in
// progress.
class Turn {
 public:
  explicit Turn(std::atomic<bool>& in_progress) : in_progress_(in_progress), mine_(!in_progress.exchange(true)) {}
  ~Turn() {
    if (mine_) in_progress_ = false;
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  explicit operator bool() const { return mine_; }

 private:
  std::atomic<bool>& in_progress_;
  const bool mine_;
};

Error out_of_turn(const char* name) {
  return {name, "", "", "",
          "called while another call is in progress; call it from one thread at a time and not from a callback"};
}

Error moved_from(const char* name) {
  return {name, "", "", "", "called on a System that was moved from; use the System that it was moved to"};
}

struct Resources {
  system::Resources for_system;
  std::uint64_t vocabulary = 0;  // its id; 0 = none
  std::string map_warning;       // reason why the poses of the loaded map cannot be relied on; may be empty
  bool map_without_words = false;
};

Result<Resources> load_resources(const Rig& rig, const system::Config& config, const Startup& startup) {
  Resources out;
  if (startup.place_recognition) {
    auto vocabulary = storage::vocabulary_or_shipped(startup.vocabulary.string());
    if (!vocabulary) return vocabulary.error();
    out.for_system.vocabulary = *std::move(vocabulary);
    out.vocabulary = out.for_system.vocabulary->id();
  }
  if (!startup.map.empty()) {
    if (!startup.place_recognition)
      return Error{"Startup", "place_recognition", "false, with a map", "true, since the rig must be found in the map"};
    auto map = storage::open_map(startup.map, api::Access::impl(rig).rig, config.feature_model().pyramid,
                                 out.for_system.vocabulary.get());
    if (!map) return map.error();
    if (const Status s = system::check_settings(config, map->map, api::Access::impl(rig).rig); !s) return s.error();
    out.for_system.map = std::move(map->map);
    out.map_warning = std::move(map->info.warning);
    out.map_without_words = map->words_end == 0;
  }
  out.for_system.masks = api::Access::impl(rig).masks;
  out.for_system.history = startup.history_frames;
  return out;
}

}  // namespace

struct System::Impl {
  Impl(const Rig& of, const system::Config& config, Resources resources, Callbacks callbacks)
      : rig(api::Access::impl(of).rig),
        vocabulary(resources.vocabulary),
        map_warning(std::move(resources.map_warning)),
        system(rig, config, std::move(resources.for_system)),
        reader(rig),
        notifier(std::move(callbacks), rig) {}

  Result<FrameResult> process(const ImageBundle& bundle);
  Status finish();
  Result<std::vector<Trajectory>> trajectories(RigFrame frame) const;

  const camera::Rig rig;
  const std::uint64_t vocabulary;
  mutable std::mutex at_end;  // guards `map_warning` and `calibration`, which finish() changes
  std::string map_warning;    // reason why the poses of the map cannot be relied on; may be empty
  system::System system;
  api::BundleReader reader;
  api::Notifier notifier;
  api::CalibrationReport calibration;  // of finish()
  bool finished = false;
  std::optional<Error> failure;  // the error that ended the run
  mutable std::atomic<bool> call_in_progress = false;
};

Result<FrameResult> System::Impl::process(const ImageBundle& bundle) {
  if (failure) return *failure;
  if (finished) {
    Error error;
    error.file = "System::process";
    error.sentence = "process() was called after finish()";
    return error;
  }
  const auto images = reader.read(bundle);
  if (!images) return images.error();
  bool refused = false;  // the frame was not accepted, and the run goes on without it
  auto frame = api::guarded("System::process", [&]() -> Result<FrameResult> {
    const auto record = system.process(*images);
    refused = !record.ok();
    if (refused) return record.error();
    return api::to_frame_result(*record, rig);
  });
  if (!frame) {
    if (!refused) failure = frame.error();
    return frame;
  }
  constexpr const char* kName = "System::process: a callback";
  const Status reported = api::guarded(kName, [&] { return notifier.processed(kName, *frame, system); });
  if (!reported) return reported.error();
  return frame;
}

Status System::Impl::finish() {
  if (failure) return *failure;
  if (finished) return Error{"System::finish", "", "a second call", "one"};
  finished = true;
  const Status done = api::guarded("System::finish", [&]() -> Status {
    system.finish();
    api::CalibrationReport report = api::report_calibration(system, rig);
    const std::lock_guard lock(at_end);
    calibration = std::move(report);
    map_warning = storage::joined_warnings(map_warning, calibration.doubt);
    return {};
  });
  if (!done) {
    failure = done.error();
    return done;
  }
  constexpr const char* kName = "System::finish: a callback";
  return api::guarded(kName, [&] { return notifier.finished(kName, system, calibration); });
}

Result<std::vector<Trajectory>> System::Impl::trajectories(RigFrame frame) const {
  std::optional<geometry::SE3> T_rig_frame;
  if (frame == RigFrame::kBody) T_rig_frame = rig.body_from_rig().inverse();
  std::vector<Trajectory> out;
  for (const system::SubmapTrajectory& part : system.trajectories()) {
    out.push_back(api::to_trajectory(part.poses, T_rig_frame));
  }
  return out;
}

System::System(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
System::System(System&& other) noexcept = default;
System& System::operator=(System&& other) noexcept = default;
System::~System() = default;

Result<System> System::create(const Rig& rig, const Config& config, Startup startup) {
  return api::guarded("System::create", [&]() -> Result<System> {
    const system::Config& settings = api::Access::impl(config).config;
    if (const Status status = system::check_config(settings, !startup.map.empty()); !status) return status.error();
    auto resources = load_resources(rig, settings, startup);
    if (!resources) return resources.error();
    const bool without_words = resources->map_without_words;
    auto impl = std::make_unique<Impl>(rig, settings, *std::move(resources), std::move(startup.callbacks));
    const Status started = impl->notifier.started("System::create", rig, api::Access::impl(config).warnings,
                                                  impl->map_warning, without_words);
    if (!started) return started.error();
    return System(std::move(impl));
  });
}

Result<FrameResult> System::process(const ImageBundle& images) {
  if (!impl_) return moved_from("System::process");
  const Turn turn(impl_->call_in_progress);
  return turn ? impl_->process(images) : out_of_turn("System::process");
}

Status System::finish() {
  if (!impl_) return moved_from("System::finish");
  const Turn turn(impl_->call_in_progress);
  return turn ? impl_->finish() : out_of_turn("System::finish");
}

CalibrationVerdict System::calibration_verdict() const {
  if (!impl_) return CalibrationVerdict::kUnknown;
  const std::lock_guard lock(impl_->at_end);
  return impl_->calibration.verdict;
}

void System::interrupt() {
  if (impl_) impl_->system.interrupt();
}

MapView System::map() const { return impl_ ? api::make_map_view(impl_->system.snapshot()) : api::empty_map_view(); }

Status System::save_map(const std::filesystem::path& file) const {
  if (!impl_) return moved_from("System::save_map");
  return api::guarded("System::save_map", [&]() -> Status {
    if (const Status s = check_output_file(file.string(), "", true, storage::kMapFileBegin); !s) return s;
    std::unique_lock lock(impl_->at_end);
    const storage::MapFileInfo info{impl_->vocabulary, BSLAM_VERSION, "live", impl_->map_warning};
    lock.unlock();
    return storage::write_map(*impl_->system.snapshot(), info, file);
  });
}

Result<std::vector<Trajectory>> System::trajectories(RigFrame frame) const {
  if (!impl_) return moved_from("System::trajectories");
  const Turn turn(impl_->call_in_progress);
  if (!turn) return out_of_turn("System::trajectories");
  return api::guarded("System::trajectories", [&] { return impl_->trajectories(frame); });
}

Result<Trajectory> System::trajectory(RigFrame frame) const {
  auto all = trajectories(frame);
  if (!all) return all.error();
  return all->empty() ? Trajectory() : std::move(all->front());
}

}  // namespace bslam
