// The class System.
#include <bslam/system.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>

#include "arguments.h"
#include "arrays.h"
#include "base/output_file.h"
#include "bindings.h"
#include "errors.h"
#include "handlers.h"
#include "images.h"
#include "settings.h"

namespace bslam::python {
namespace {

using Path = std::filesystem::path;

// A System with the Python functions that it calls. All calls that take time release the GIL.
class PythonSystem {
 public:
  PythonSystem(const Rig& rig, const Config& config, Startup startup, Handlers handlers);
  ~PythonSystem();
  PythonSystem(const PythonSystem&) = delete;
  PythonSystem& operator=(const PythonSystem&) = delete;

  FrameResult process(nb::handle stamps, nb::handle images, nb::handle masks);
  void finish();
  System& operator*() { return *system_; }
  Handlers& handlers() { return handlers_; }

 private:
  Handlers handlers_;
  std::optional<System> system_;
};

PythonSystem::PythonSystem(const Rig& rig, const Config& config, Startup startup, Handlers handlers)
    : handlers_(std::move(handlers)) {
  startup.callbacks = handlers_.callbacks();
  auto created = [&] {
    const nb::gil_scoped_release unlocked;
    return System::create(rig, config, std::move(startup));
  }();
  handlers_.rethrow();
  system_.emplace(value_of(std::move(created)));
}

PythonSystem::~PythonSystem() {
  const nb::gil_scoped_release unlocked;  // it waits for background work
  system_.reset();
}

FrameResult PythonSystem::process(nb::handle stamps, nb::handle images, nb::handle masks) {
  const BorrowedImages borrowed = read_images(stamps, images, masks);
  auto frame = [&] {
    const nb::gil_scoped_release unlocked;
    return system_->process(borrowed.bundle);
  }();
  handlers_.rethrow();
  return value_of(std::move(frame));
}

void PythonSystem::finish() {
  const Status done = [&] {
    const nb::gil_scoped_release unlocked;
    return system_->finish();
  }();
  handlers_.rethrow();
  check(done);
}

RigFrame frame_named(const std::string& name) {
  if (name == "cam0") return RigFrame::kCamera0;
  if (name == "body") return RigFrame::kBody;
  raise({"System.trajectory", "frame", name, "cam0 or body"});
}

std::vector<Rows8> trajectories(PythonSystem& system, const std::string& frame) {
  std::vector<Rows8> out;
  for (const Trajectory& trajectory : value_of((*system).trajectories(frame_named(frame)))) {
    out.push_back(rows_of(trajectory));
  }
  return out;
}

void save_trajectory(PythonSystem& system, const Path& path, const std::string& frame) {
  const RigFrame chosen = frame_named(frame);
  check(check_output_file(path.string(), "", true, "# bslam trajectory"));
  check(write_tum(path, value_of((*system).trajectory(chosen)), chosen));
}

void save_map(PythonSystem& system, const Path& path) {
  const Status saved = [&] {
    const nb::gil_scoped_release unlocked;
    return (*system).save_map(path);
  }();
  check(saved);
}

int visit_references(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  for (const nb::object* object : nb::inst_ptr<PythonSystem>(self)->handlers().references()) Py_VISIT(object->ptr());
  return 0;
}

int clear_references(PyObject* self) {
  if (!nb::inst_ready(self)) return 0;
  for (nb::object* object : nb::inst_ptr<PythonSystem>(self)->handlers().references()) *object = nb::none();
  return 0;
}

PyType_Slot g_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(visit_references)},
                         {Py_tp_clear, reinterpret_cast<void*>(clear_references)},
                         {0, nullptr}};

const Rig& rig_argument(nb::handle rig) {
  if (!nb::isinstance<Rig>(rig) || !nb::inst_ready(rig))
    raise({"System", "rig", description_of(rig), "a Rig; Rig.load(path) reads a calibration"});
  return *nb::inst_ptr<Rig>(rig);
}

Path path_argument(nb::handle path, const char* key) {
  return optional_argument<Path>(path, "System", key, "the name of a file").value_or("");
}

SettingArguments setting_arguments(nb::handle mode, nb::handle settings, nb::handle config, nb::handle seed,
                                   nb::handle localize_only) {
  if (!settings.is_none() && !nb::hasattr(settings, "items"))
    raise({"System", "settings", description_of(settings), "a dict of names and values"});
  return {optional_argument<Path>(config, "System", "config", "the name of a file"), settings,
          argument<std::string>(mode, "System", "mode", "sequential, lagged or parallel"),
          optional_argument<int>(seed, "System", "seed", "an integer"),
          argument<bool>(localize_only, "System", "localize_only", "True or False")};
}

void bind_constructor(nb::class_<PythonSystem>& system) {
  system.def(
      "__init__",
      [](PythonSystem* self, nb::handle rig, nb::handle mode, nb::handle settings, nb::handle config, nb::handle seed,
         nb::handle load_map, nb::handle localize_only, nb::handle vocabulary, nb::handle history_frames,
         nb::object on_keyframe, nb::object on_loop, nb::object on_camera, nb::object on_log) {
        const Rig& cameras = rig_argument(rig);
        Startup startup;
        startup.map = path_argument(load_map, "load_map");
        startup.vocabulary = path_argument(vocabulary, "vocabulary");
        startup.history_frames =
            argument<std::size_t>(history_frames, "System", "history_frames", "an integer of 0 or more");
        Handlers handlers;
        handlers.keyframe = std::move(on_keyframe);
        handlers.loop = std::move(on_loop);
        handlers.camera = std::move(on_camera);
        handlers.log = std::move(on_log);
        new (self) PythonSystem(cameras, make_config(setting_arguments(mode, settings, config, seed, localize_only)),
                                std::move(startup), std::move(handlers));
      },
      nb::arg("rig").none(), nb::arg("mode").none() = "", nb::kw_only(), nb::arg("settings") = nb::none(),
      nb::arg("config") = nb::none(), nb::arg("seed") = nb::none(), nb::arg("load_map") = nb::none(),
      nb::arg("localize_only").none() = false, nb::arg("vocabulary") = nb::none(), nb::arg("history_frames").none() = 0,
      nb::arg("on_keyframe") = nb::none(), nb::arg("on_loop") = nb::none(), nb::arg("on_camera") = nb::none(),
      nb::arg("on_log") = nb::none(),
      nb::sig("def __init__(self, rig: Rig, mode: str = \"\", *, "
              "settings: collections.abc.Mapping[str, object] | None = None, "
              "config: str | os.PathLike[str] | None = None, seed: int | None = None, "
              "load_map: str | os.PathLike[str] | None = None, localize_only: bool = False, "
              "vocabulary: str | os.PathLike[str] | None = None, history_frames: int = 0, "
              "on_keyframe: collections.abc.Callable[[KeyframeEvent], object] | None = None, "
              "on_loop: collections.abc.Callable[[LoopEvent], object] | None = None, "
              "on_camera: collections.abc.Callable[[CameraEvent], object] | None = None, "
              "on_log: collections.abc.Callable[[str, str], object] | None = None) -> None"),
      "Creates a system. Arguments have the names of the options of `bslam run`.\n\n"
      "Args:\n"
      "    rig: the calibrated cameras.\n"
      "    mode: sequential, lagged or parallel; default: that of `settings` or `config`, otherwise parallel.\n"
      "        sequential and lagged give the same result on every run.\n"
      "    settings: names and values, such as {\"features.per_image\": 1000}; they override `config`.\n"
      "    config: YAML file with settings, such as the config.yaml of a run.\n"
      "    seed: seed of all random numbers.\n"
      "    load_map: saved map to continue after relocalising in it.\n"
      "    localize_only: localise in `load_map` without changing it.\n"
      "    vocabulary: file for place recognition; default: the one shipped with bslam.\n"
      "    history_frames: minimum number of latest frames in trajectories, for long runs; 0: all.\n"
      "    on_keyframe, on_loop, on_camera: called with a KeyframeEvent, LoopEvent or CameraEvent.\n"
      "    on_log: called with a level (\"info\" or \"warning\") and a line of text.\n\n"
      "The functions are called by the thread that is in process() or finish(), before it returns. If one of them\n"
      "raises an exception, that call raises it.");
}

void bind_processing(nb::class_<PythonSystem>& system) {
  system
      .def(
          "process", &PythonSystem::process, nb::arg("stamps").none(), nb::arg("images").none(),
          nb::arg("masks") = nb::none(),
          nb::sig("def process(self, stamps: int | collections.abc.Sequence[int | None], "
                  "images: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8] | None], "
                  "masks: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8] | None] | None = None) -> Frame"),
          "Estimates the pose of the rig for images taken at the same time.\n\n"
          "The images are raw (neither undistorted nor rectified). They are read without a copy during the call, with\n"
          "the GIL released, so do not change them meanwhile; afterwards their memory may be used again.\n\n"
          "Args:\n"
          "    stamps: middle of each exposure in nanoseconds, or one time for all images.\n"
          "    images: one per camera of the rig, in its order: uint8 of shape (height, width) with contiguous pixels\n"
          "        in a row. Rows may be padded, but neither overlap nor run upwards. None where there is no image.\n"
          "    masks: uint8 like the images; 0 marks pixels to ignore. None where there is no mask.\n\n"
          "Returns:\n"
          "    The result. A lost frame is a result, not an error.")
      .def("finish", &PythonSystem::finish,
           "Waits for background work and adjusts the whole map. To be called once, after the last frame.")
      .def(
          "interrupt", [](PythonSystem& s) { (*s).interrupt(); },
          "Makes the current call in another thread and finish() return soon. Background work is not resumed.");
}

}  // namespace

void bind_system(nb::module_& module) {
  bind_events(module);
  nb::class_<PythonSystem> system(module, "System", nb::type_slots(g_slots),
                                  "SLAM: images of a rig in, poses and a map out. One thread at a time may call "
                                  "process(), finish() and trajectory(); map() and save_map() may be called from any "
                                  "thread at any time.");
  bind_constructor(system);
  bind_processing(system);
  system
      .def_prop_ro(
          "calibration_verdict", [](PythonSystem& s) { return std::string(to_string((*s).calibration_verdict())); },
          "Whether the images agree with the calibration: unknown, consistent or inconsistent; unknown before\n"
          "finish(), which tells on_log how the estimate differs from the calibration.")
      .def(
          "map", [](PythonSystem& s) { return (*s).map(); }, "Returns the current version of the map.")
      .def("save_map", save_map, nb::arg("path"),
           "Saves the current map, completely or not at all. It replaces an earlier map, and no other file.")
      .def(
          "trajectory",
          [](PythonSystem& s, const std::string& frame) {
            return rows_of(value_of((*s).trajectory(frame_named(frame))));
          },
          nb::arg("frame") = "cam0",
          "Returns the poses of all frames that have one, corrected by the current map, for the submap with the most\n"
          "frames: (n, 8) with t, x, y, z, qx, qy, qz, qw in seconds and metres.\n\n"
          "Args:\n"
          "    frame: cam0 (camera 0) or body (the body frame of the calibration).")
      .def("trajectories", trajectories, nb::arg("frame") = "cam0",
           "Returns trajectory() of all submaps; the submap with the most frames is first.")
      .def("save_trajectory", save_trajectory, nb::arg("path"), nb::arg("frame") = "cam0",
           "Writes trajectory() as TUM file, with times that are exact to the nanosecond. It replaces an earlier\n"
           "trajectory of bslam, and no other file.");
}

}  // namespace bslam::python
