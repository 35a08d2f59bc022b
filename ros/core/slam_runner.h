// Runs SLAM on images that arrive in any order, in a thread of its own, and tells a node what to publish.
#pragma once

#include <bslam/bslam.h>

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/image_conversion.h"
#include "core/outputs.h"
#include "core/parameters.h"
#include "core/pose_output.h"

namespace bslam_ros {

class SlamRunner {
 public:
  // The body frame of `rig` must be base_link (with_base_as_body). Uses the settings and periods of `parameters`, and
  // its map_file; topics and frames are the node's. Errors: those of bslam::System and bslam::Synchronizer.
  static bslam::Result<std::unique_ptr<SlamRunner>> create(const bslam::Rig& rig, const Parameters& parameters,
                                                           Outputs outputs);
  ~SlamRunner();  // as stop()
  SlamRunner(const SlamRunner&) = delete;
  SlamRunner& operator=(const SlamRunner&) = delete;

  // Adds an image, from any thread. Errors, which are also counted and logged once per camera and message: those of
  // to_grey; a size that differs from the calibration; a stamp beyond the range of the Synchronizer.
  bslam::Status push(std::size_t camera, const RawImage& image, std::int64_t time_ns);

  // Counts and logs an image that the node could not read, such as a damaged compressed image.
  void reject(std::size_t camera, const bslam::Error& error);

  // Services, from any thread. SLAM continues meanwhile.
  bslam::Status save_map(const std::string& file);
  // Continues in a saved map, after the rig was recognised in it; the present map is dropped. `localize_only`: the map
  // is not changed. On error the present map is continued.
  bslam::Status load_map(const std::string& file, bool localize_only);
  // On: the present map is not changed from now on. Off: it is continued. The rig is recognised in it first, which
  // takes a frame or more. Errors: no map yet; it cannot be written to a temporary file.
  bslam::Status set_localize_only(bool on);

  // State of tracking and of each camera, from any thread. Images that stopped are reported by the system clock.
  std::vector<DiagnosticStatus> diagnostics() const;

  // Processes the images that have arrived and ends the thread; further images are rejected. Writes trajectory_file, if
  // given, and again after adjusting the map, and beside it a numbered file for the time before each change of the map
  // by a service (earlier_trajectory_file). Outputs are not called afterwards.
  bslam::Status stop();

 private:
  SlamRunner(const bslam::Rig& rig, const Parameters& parameters, bslam::Config config, Outputs outputs);

  struct CameraCounts {
    std::size_t rejected = 0;  // could not be converted
    std::string last_error;
    std::array<std::size_t, bslam::kDropReasons> dropped = {};  // by the Synchronizer, for each reason
  };
  using Clock = std::chrono::steady_clock;

  bslam::Result<std::shared_ptr<bslam::System>> make_system(const std::string& map, bool localize_only);
  bslam::Status replace_system(const std::string& map, bool localize_only);
  void run();
  void take_over();
  void keep_trajectory(const bslam::System& before);
  bool process(const bslam::ImageBundle& images);
  void note_failure(const std::string& what);
  void warn(const std::string& text);
  void note_drop(const bslam::DroppedImage& image);
  void report_changes(const std::optional<bslam::FrameResult>& before, const bslam::FrameResult& now);
  void publish_cloud(const bslam::FrameResult& frame);
  void publish_path(const bslam::FrameResult& frame);
  void log(bslam::LogLevel level, const std::string& line) const;
  bslam::Status write_trajectories();
  bslam::Status write_present_trajectory() const;
  bslam::Status write_trajectory(const std::string& file, bslam::Trajectory trajectory) const;

  const bslam::Rig rig_;
  const Parameters parameters_;
  const bslam::Config config_;
  const Outputs outputs_;
  PoseConverter converter_;
  std::optional<bslam::Synchronizer> synchronizer_;

  mutable std::mutex mutex_;  // guards all until `thread_`
  std::shared_ptr<bslam::System> system_, next_system_;
  bool localize_only_ = false, next_localize_only_ = false;
  std::vector<CameraCounts> counts_;
  std::optional<bslam::FrameResult> last_;
  std::string failure_;  // of the last frame: an error of System::process, or an exception
  std::size_t frames_ = 0, lost_ = 0;
  Clock::time_point last_frame_at_ = Clock::now();

  std::atomic<std::size_t> loops_ = 0;
  std::atomic<bool> map_changed_ = false;
  std::int64_t cloud_ns_ = 0, path_ns_ = 0;  // times of the last ones; these and the next five are the thread's
  bool cloud_due_ = false;
  std::size_t cloud_subscribers_ = 0;  // at the last frame
  bool cloud_published_ = false, path_published_ = false;
  std::vector<bslam::Trajectory> earlier_;  // of the Systems that were replaced; the thread's
  std::string last_warning_;                // of a frame, without its numbers; empty after a good frame; the thread's
  std::size_t num_same_warnings_ = 0;       // after the first; the thread's
  bool stopped_ = false;
  std::mutex replacement_;  // held by the service that replaces the System
  std::thread thread_;
};

}  // namespace bslam_ros
