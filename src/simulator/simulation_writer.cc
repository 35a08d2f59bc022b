#include "simulator/simulation_writer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <png.h>

#include <array>
#include <cmath>
#include <fstream>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/assert.h"
#include "base/atomic_file.h"
#include "evaluation/trajectory_file.h"
#include "rig_formats/euroc_sensor.h"
#include "rig_formats/rig_file.h"
#include "simulator/recorder.h"
#include "simulator/request_checks.h"

namespace bslam::simulator {
namespace {

namespace fs = std::filesystem;

constexpr int kWorldVersion = 1;  // version of the images; to be incremented whenever the images of a request change
constexpr int kListsVersion = 2;  // version of the other files; to be incremented whenever they change
constexpr double kGroundTruthRate = 200.0;  // Hz
using rig_formats::kComplete, rig_formats::kPartial;

Status make_folder(const fs::path& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{folder.string(), "", code.message(), "a folder that can be created"};
  return {};
}

// Returns the content of the marker file `name` in `folder`, or an empty string if it does not exist.
std::string marker(const fs::path& folder, const char* name) {
  const auto text = read_file(folder / name, 1024);
  return text ? text->substr(0, text->find('\n')) : std::string();
}

std::string complete_mark(const std::string& digest) { return fmt::format("{} lists {}", digest, kListsVersion); }

bool is_complete(const fs::path& folder, const std::string& digest) {
  return marker(folder, kComplete) == complete_mark(digest);
}

enum class FolderState { kFresh, kSameIncomplete };

// Examines and prepares the folder, whose recording is not complete. With `overwrite`, an earlier simulated recording
// is removed.
Result<FolderState> prepare_folder(const SimulationRequest& request, const std::string& digest) {
  const fs::path& folder = request.folder;
  std::error_code code;
  if (fs::exists(folder, code) && !fs::is_directory(folder, code)) {
    return Error{folder.string(), "", "a file", "a folder to write into"};
  }
  if (const Status s = make_folder(folder); !s) return s.error();
  const std::string complete = marker(folder, kComplete), partial = marker(folder, kPartial);
  if (complete.starts_with(digest)) return FolderState::kSameIncomplete;  // the lists have another version
  const bool is_simulation = !complete.empty() || !partial.empty();
  if (partial == digest && complete.empty()) return FolderState::kSameIncomplete;
  if (!fs::is_empty(folder, code) && !request.overwrite) {
    return Error{folder.string(), "",
                 is_simulation ? "the recording of another simulation" : "a folder that is not empty",
                 "a new or empty folder, or --overwrite"};
  }
  if (is_simulation) fs::remove_all(folder / "mav0", code);
  fs::remove(folder / kComplete, code);
  if (const Status s = write_atomically(folder / kPartial, digest + "\n"); !s) return s.error();
  return FolderState::kFresh;
}

fs::path camera_folder(const fs::path& folder, std::size_t camera) {
  return folder / "mav0" / fmt::format("cam{}", camera);
}

std::string image_name(const Shot& shot) { return fmt::format("{}.png", shot.stamp_ns); }

fs::path image_file(const fs::path& folder, const Shot& shot) {
  return camera_folder(folder, shot.camera) / "data" / image_name(shot);
}

Status write_image(const fs::path& file, const image::Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width());
  header.height = static_cast<png_uint_32>(image.height());
  header.format = PNG_FORMAT_GRAY;
  header.flags = PNG_IMAGE_FLAG_FAST;
  std::string png(PNG_IMAGE_PNG_SIZE_MAX(header), '\0');
  png_alloc_size_t size = png.size();
  if (!png_image_write_to_memory(&header, png.data(), &size, 0, image.row(0), image.width(), nullptr))
    return Error{file.string(), "", "an image that cannot be stored as PNG", "a grey image"};
  return write_atomically(file, {png.data(), size});
}

// Writes the images of a recording, section by section.
class ImageWriter {
 public:
  ImageWriter(const SimulationRequest& request, const Scenery& scenery, const std::vector<Shot>& shots,
              ThreadPool& pool, const SimulationProgress& progress, std::stop_token stop)
      : request_(request), scenery_(scenery), shots_(shots), pool_(pool), progress_(progress), stop_(std::move(stop)) {}

  // Writes all images that do not exist yet. Returns false if a stop was requested before all were written.
  Result<bool> write() {
    std::vector<std::vector<std::size_t>> missing(scenery_.section_ends.size());  // by section, in order
    for (std::size_t i = 0; i < shots_.size(); ++i) {
      std::error_code code;
      if (shots_[i].written && !fs::exists(image_file(request_.folder, shots_[i]), code)) {
        missing[scenery_.section_at(shots_[i].scene_time_s)].push_back(i);
      } else {
        ++done_;
      }
    }
    if (done_ > 0 && progress_) progress_(done_, shots_.size());
    for (std::size_t section = 0; section < missing.size() && !failure_ && !stop_.stop_requested(); ++section) {
      if (!missing[section].empty()) write_section(section, missing[section]);
    }
    if (failure_) return *failure_;
    return done_ == shots_.size();
  }

 private:
  void write_section(std::size_t section, const std::vector<std::size_t>& missing) {
    const World world(scenery_.building(section), scenery_.world, pool_);
    const Recorder recorder(world, request_.rig, scenery_.trajectory, request_.imaging, request_.recording.exposure_s,
                            pool_);
    pool_.for_each(missing.size(), [&](std::size_t k) {
      {
        const std::lock_guard lock(mutex_);
        if (failure_ || stop_.stop_requested()) return;
      }
      const Shot& shot = shots_[missing[k]];
      const Status status = write_image(image_file(request_.folder, shot), recorder.render(shot));
      const std::lock_guard lock(mutex_);
      ++done_;
      if (!status && !failure_) failure_ = status.error();
      if (progress_) progress_(done_, shots_.size());
    });
  }

  const SimulationRequest& request_;
  const Scenery& scenery_;
  const std::vector<Shot>& shots_;
  ThreadPool& pool_;
  const SimulationProgress& progress_;
  std::stop_token stop_;
  std::mutex mutex_;
  std::size_t done_ = 0;  // images that exist, or are missing on purpose
  std::optional<Error> failure_;
};

std::string image_list(const std::vector<Shot>& shots, std::size_t camera) {
  std::string text = "#timestamp [ns],filename\n";
  for (const Shot& shot : shots) {
    if (shot.camera == camera && shot.written) text += fmt::format("{},{}\n", shot.stamp_ns, image_name(shot));
  }
  return text;
}

std::string fault_list(const std::vector<Shot>& shots) {
  std::string text = "#timestamp [ns],camera,filename,fault\n";
  for (const Shot& shot : shots) {
    if (shot.fault)
      text += fmt::format("{},{},{},{}\n", shot.stamp_ns, shot.camera, image_name(shot), fault_name(*shot.fault));
  }
  return text;
}

// Writes the poses of the body in pieces, since those of long recordings would need much memory.
Status write_body_truth(const fs::path& file, const SimulationRequest& request,
                        const synthetic::Trajectory& trajectory) {
  fs::path part = file;
  part += ".part";
  std::ofstream out(part, std::ios::binary);
  out << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x "
         "[m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z "
         "[rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  const auto count = static_cast<std::size_t>(std::lround(request.recording.duration_s * kGroundTruthRate));
  for (std::size_t i = 0; i <= count; ++i) {
    const TimeNs since_start = from_seconds(static_cast<double>(i) / kGroundTruthRate);
    const geometry::SE3 T = trajectory.T_world_body(to_seconds(since_start));
    const Eigen::Vector3d p = T.translation(), v = trajectory.velocity(to_seconds(since_start));
    const Eigen::Quaterniond q = T.rotation();
    out << fmt::format("{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f},{:.9f},{:.9f},{:.9f},0,0,0,0,0,0\n",
                       request.recording.start_ns + since_start, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(),
                       v.y(), v.z());
  }
  out.close();
  std::error_code code;
  if (out) fs::rename(part, file, code);
  if (!out || code) return Error{file.string(), "", "a file that cannot be written", "space on the disk"};
  return {};
}

Status write_lists(const SimulationRequest& request, const std::vector<Shot>& shots,
                   const synthetic::Trajectory& trajectory) {
  const fs::path& folder = request.folder;
  const camera::Rig& rig = request.rig;
  const bool sensors = rig_formats::euroc_holds_models(rig);  // rig.yaml supports all models
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (Status s = write_atomically(camera_folder(folder, c) / "data.csv", image_list(shots, c)); !s) return s;
    const fs::path sensor = camera_folder(folder, c) / "sensor.yaml";
    if (!sensors) {
      std::error_code code;
      fs::remove(sensor, code);
      continue;
    }
    const camera::RigCamera camera{rig.camera(c), rig.body_from_cam(c)};
    if (Status s = write_atomically(sensor, rig_formats::euroc_sensor_yaml(camera, request.recording.rate_hz)); !s)
      return s;
  }
  const fs::path truth = folder / "mav0" / "state_groundtruth_estimate0";
  if (Status s = make_folder(truth); !s) return s;
  if (Status s = write_body_truth(truth / "data.csv", request, trajectory); !s) return s;
  evaluation::Trajectory of_camera0;
  const TimeNs offset = rig.camera(std::size_t{0}).time_offset_ns;
  for (const Shot& shot : shots) {
    if (shot.camera != 0) continue;
    // The pose at the true time of the stamp, regardless of faults.
    const TimeNs time_ns = shot.stamp_ns + offset;
    const geometry::SE3 T_world_body = trajectory.T_world_body(to_seconds(time_ns - request.recording.start_ns));
    of_camera0.push_back({time_ns, T_world_body * rig.body_from_cam(0)});
  }
  if (Status s =
          evaluation::write_trajectory(folder / "groundtruth_cam0.tum", of_camera0, evaluation::TrajectoryFormat::kTum);
      !s)
    return s;
  if (Status s = rig_formats::write_rig(rig, folder / "rig.yaml"); !s) return s;
  return write_atomically(folder / "faults.csv", fault_list(shots));
}

}  // namespace

Result<double> drive_duration(const SimulationRequest& request) {
  BSLAM_ASSERT(request.kind == WorldKind::kTown, "only drives through the town have a duration of their own");
  if (const Status s = check_tour(request); !s) return s.error();
  const double duration_s = make_scenery(request.kind, request.seed, request.tour, request.world).section_ends.back();
  if (duration_s > kMaxDuration_s) {
    return Error{"", "length", fmt::format("a drive of {:.0f} s", duration_s),
                 fmt::format("at most {:.0f} s: a shorter length, a higher --speed, or a --duration", kMaxDuration_s)};
  }
  return duration_s;
}

std::string simulation_digest(const SimulationRequest& r) {
  std::string text = fmt::format("{} {} {} {} {} {}\n", kWorldVersion, r.seed, r.recording.duration_s,
                                 r.recording.rate_hz, r.recording.exposure_s, r.recording.start_ns);
  text += fmt::format("{} {} {}\n", r.tour.laps, r.tour.speed_mps, r.tour.seed);
  text += fmt::format("{} {} {} {} {} {} {}\n", r.imaging.gain, r.imaging.gamma, r.imaging.vignetting, r.imaging.noise,
                      r.imaging.shot_noise, r.imaging.read_noise, r.imaging.seed);
  text += fmt::format("{} {} {}\n", r.world.texel, r.world.light_texel, r.world.ambient_rays);
  for (const Fault& f : r.recording.faults) {
    text += fmt::format("{} {} {} {}", fault_name(f.type), f.from_s, f.to_s, f.delay_s);
    for (const int camera : f.cameras) text += fmt::format(" {}", camera);
    text += '\n';
  }
  if (r.kind != WorldKind::kBuilding) text += fmt::format("world {}\n", static_cast<int>(r.kind));
  if (r.tour.back) text += "back\n";
  if (r.tour.length_m > 0) text += fmt::format("length {}\n", r.tour.length_m);
  const WorldOptions usual, &w = r.world;
  const auto others = [](const WorldOptions& o) {
    return std::array{o.texel_per_distance, o.hidden_texel, o.sample_spacing, o.hiding_distance};
  };
  if (others(w) != others(usual)) text += fmt::format("texels {}\n", fmt::join(others(w), " "));
  text += rig_formats::rig_to_yaml(r.rig);
  std::uint64_t digest = 0xcbf29ce484222325ull;  // FNV-1a
  for (const char c : text) digest = (digest ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return fmt::format("{:016x}", digest);
}

Result<SimulationOutcome> write_simulation(const SimulationRequest& request, ThreadPool& pool,
                                           const SimulationProgress& progress, std::stop_token stop) {
  if (const Status s = check_request(request); !s) return s.error();
  const std::string digest = simulation_digest(request);
  if (is_complete(request.folder, digest)) return SimulationOutcome::kWasComplete;
  TourOptions tour = request.tour;
  tour.duration_s = request.recording.duration_s;
  const Scenery scenery = make_scenery(request.kind, request.seed, tour, request.world);
  if (const Status s = check_scenery(request, scenery); !s) return s.error();
  const auto state = prepare_folder(request, digest);
  if (!state) return state.error();
  for (std::size_t c = 0; c < request.rig.size(); ++c) {
    if (const Status s = make_folder(camera_folder(request.folder, c) / "data"); !s) return s.error();
  }
  const std::vector<Shot> shots = plan_shots(request.rig, request.recording);
  if (*state == FolderState::kFresh) {  // existing images may belong to another recording
    std::error_code code;
    for (const Shot& shot : shots) fs::remove(image_file(request.folder, shot), code);
  }
  const auto all = ImageWriter(request, scenery, shots, pool, progress, stop).write();
  if (!all) return all.error();
  if (!*all) return SimulationOutcome::kInterrupted;
  if (const Status s = write_lists(request, shots, scenery.trajectory); !s) return s.error();
  if (const Status s = write_atomically(request.folder / kComplete, complete_mark(digest) + "\n"); !s) return s.error();
  std::error_code code;
  fs::remove(request.folder / kPartial, code);
  return SimulationOutcome::kWritten;
}

}  // namespace bslam::simulator
