#include "simulator/simulation_writer.h"

#include <fmt/format.h>
#include <png.h>

#include <cmath>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "base/atomic_file.h"
#include "evaluation/trajectory_file.h"
#include "rig_formats/euroc_sensor.h"
#include "rig_formats/rig_file.h"
#include "simulator/clearance.h"

namespace bslam::simulator {
namespace {

namespace fs = std::filesystem;

constexpr int kWorldVersion = 1;  // version of the images; to be incremented whenever the images of a request change
constexpr int kListsVersion = 2;  // version of the other files; to be incremented whenever they change
constexpr double kGroundTruthRate = 200.0;  // Hz
constexpr const char* kPartial = ".partial";
constexpr const char* kComplete = ".complete";

Status check(const SimulationRequest& r) {
  const auto out_of_range = [](const char* key, double found, const char* expected) {
    return Error{"", key, fmt::format("{}", found), expected};
  };
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!(within(r.recording.duration_s, 1e-3, 86400)))
    return out_of_range("duration", r.recording.duration_s, "seconds in (0, 86400]");
  if (!(within(r.recording.rate_hz, 1e-3, 1000)))
    return out_of_range("rate", r.recording.rate_hz, "images per second in (0, 1000]");
  if (!within(r.recording.exposure_s, 0, 1))
    return out_of_range("exposure-ms", 1e3 * r.recording.exposure_s, "milliseconds in [0, 1000]");
  for (const Fault& f : r.recording.faults) {
    if (f.from_s >= r.recording.duration_s) {
      return Error{"", "faults", fmt::format("{} from {} s", fault_name(f.type), f.from_s),
                   fmt::format("a start time within the {} s of the recording", r.recording.duration_s)};
    }
  }
  if (!within(r.imaging.noise, 0, 1000)) return out_of_range("noise", r.imaging.noise, "a factor in [0, 1000]");
  if (!within(to_seconds(r.recording.start_ns), 0, 4e9))
    return out_of_range("start", to_seconds(r.recording.start_ns), "seconds in [0, 4e9]");
  if (!within(r.tour.speed_mps, 0, 5))
    return out_of_range("speed", r.tour.speed_mps, "metres per second in [0, 5] (0: walking pace)");
  if (!within(r.tour.laps, 0, 1000))
    return out_of_range("laps", r.tour.laps, "a number in [0, 1000] (0: determined by the walking pace)");
  if (r.tour.laps > 0 && r.tour.speed_mps > 0) {
    return Error{"", "speed", fmt::format("{} with {} laps", r.tour.speed_mps, r.tour.laps),
                 "either a speed or a number of laps"};
  }
  return {};
}

Status check_clearance(const SimulationRequest& r, const Building& building, const synthetic::Trajectory& tour) {
  const auto collision = first_collision(building.surfaces, r.rig, tour, r.recording.duration_s);
  if (!collision) return {};
  const std::string& camera = r.rig.camera(collision->camera).name;
  const std::string place = collision->distance > 0 ? fmt::format("{:.3f} m from a surface", collision->distance)
                                                    : std::string("behind a wall, the floor or the ceiling");
  return Error{"", "rig", fmt::format("camera {} {} after {:.2f} s", camera, place, collision->time_s),
               fmt::format("cameras that keep {} m from all surfaces: a smaller rig{}", kCameraClearance,
                           r.kind == WorldKind::kOutdoor ? "" : ", or --world outdoor")};
}

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

enum class FolderState { kFresh, kSameIncomplete, kSameComplete };

// Examines and prepares the folder. With `overwrite`, an earlier simulated recording is removed.
Result<FolderState> prepare_folder(const SimulationRequest& request, const std::string& digest) {
  const fs::path& folder = request.folder;
  std::error_code code;
  if (fs::exists(folder, code) && !fs::is_directory(folder, code)) {
    return Error{folder.string(), "", "a file", "a folder to write into"};
  }
  if (const Status s = make_folder(folder); !s) return s.error();
  const std::string complete = marker(folder, kComplete), partial = marker(folder, kPartial);
  if (complete == complete_mark(digest)) return FolderState::kSameComplete;
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

// Writes all images that do not exist yet. Returns false if a stop was requested before all were written.
Result<bool> write_images(const SimulationRequest& request, const std::vector<Shot>& shots, const Recorder& recorder,
                          ThreadPool& pool, const SimulationProgress& progress, const std::stop_token& stop) {
  std::mutex mutex;
  std::size_t done = 0;
  std::optional<Error> failure;
  pool.for_each(shots.size(), [&](std::size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (failure || stop.stop_requested()) return;
    }
    const fs::path file = image_file(request.folder, shots[i]);
    Status status;
    std::error_code code;
    if (shots[i].written && !fs::exists(file, code)) status = write_image(file, recorder.render(shots[i]));
    const std::lock_guard lock(mutex);
    ++done;
    if (!status && !failure) failure = status.error();
    if (progress) progress(done, shots.size());
  });
  if (failure) return *failure;
  return done == shots.size();
}

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

std::string body_truth(const SimulationRequest& request, const synthetic::Trajectory& trajectory) {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m "
      "s^-1], "
      "v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
      "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  const auto count = static_cast<std::size_t>(std::lround(request.recording.duration_s * kGroundTruthRate));
  for (std::size_t i = 0; i <= count; ++i) {
    const TimeNs since_start = from_seconds(static_cast<double>(i) / kGroundTruthRate);
    const geometry::SE3 T = trajectory.T_world_body(to_seconds(since_start));
    const Eigen::Vector3d p = T.translation(), v = trajectory.velocity(to_seconds(since_start));
    const Eigen::Quaterniond q = T.rotation();
    text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f},{:.9f},{:.9f},{:.9f},0,0,0,0,0,0\n",
                        request.recording.start_ns + since_start, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(),
                        v.x(), v.y(), v.z());
  }
  return text;
}

Status write_lists(const SimulationRequest& request, const std::vector<Shot>& shots, const Recorder& recorder) {
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
  if (Status s = write_atomically(truth / "data.csv", body_truth(request, recorder.trajectory())); !s) return s;
  evaluation::Trajectory of_camera0;
  const TimeNs offset = rig.camera(std::size_t{0}).time_offset_ns;
  for (const Shot& shot : shots) {
    if (shot.camera != 0) continue;
    // The pose at the true time of the stamp, regardless of faults.
    const TimeNs time_ns = shot.stamp_ns + offset;
    of_camera0.push_back({time_ns, recorder.T_world_cam(0, to_seconds(time_ns - request.recording.start_ns))});
  }
  if (Status s =
          evaluation::write_trajectory(folder / "groundtruth_cam0.tum", of_camera0, evaluation::TrajectoryFormat::kTum);
      !s)
    return s;
  if (Status s = rig_formats::write_rig(rig, folder / "rig.yaml"); !s) return s;
  return write_atomically(folder / "faults.csv", fault_list(shots));
}

}  // namespace

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
  text += rig_formats::rig_to_yaml(r.rig);
  std::uint64_t digest = 0xcbf29ce484222325ull;  // FNV-1a
  for (const char c : text) digest = (digest ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return fmt::format("{:016x}", digest);
}

Result<SimulationOutcome> write_simulation(const SimulationRequest& request, ThreadPool& pool,
                                           const SimulationProgress& progress, std::stop_token stop) {
  if (const Status s = check(request); !s) return s.error();
  const Building building = make_building(request.kind, request.seed);
  TourOptions tour_options = request.tour;
  tour_options.duration_s = request.recording.duration_s;
  const synthetic::Trajectory tour = make_tour(building, tour_options);
  if (const Status s = check_clearance(request, building, tour); !s) return s.error();
  const std::string digest = simulation_digest(request);
  const auto state = prepare_folder(request, digest);
  if (!state) return state.error();
  if (*state == FolderState::kSameComplete) return SimulationOutcome::kWasComplete;
  for (std::size_t c = 0; c < request.rig.size(); ++c) {
    if (const Status s = make_folder(camera_folder(request.folder, c) / "data"); !s) return s.error();
  }
  const std::vector<Shot> shots = plan_shots(request.rig, request.recording);
  if (*state == FolderState::kFresh) {  // existing images may belong to another recording
    std::error_code code;
    for (const Shot& shot : shots) fs::remove(image_file(request.folder, shot), code);
  }
  const World world(building, request.world, pool, stop);
  if (stop.stop_requested()) return SimulationOutcome::kInterrupted;
  const Recorder recorder(world, request.rig, tour, request.imaging, request.recording.exposure_s, pool);
  const auto all = write_images(request, shots, recorder, pool, progress, stop);
  if (!all) return all.error();
  if (!*all) return SimulationOutcome::kInterrupted;
  if (const Status s = write_lists(request, shots, recorder); !s) return s.error();
  if (const Status s = write_atomically(request.folder / kComplete, complete_mark(digest) + "\n"); !s) return s.error();
  std::error_code code;
  fs::remove(request.folder / kPartial, code);
  return SimulationOutcome::kWritten;
}

}  // namespace bslam::simulator
