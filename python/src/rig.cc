// The classes Camera and Rig.
#include <bslam/rig.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "errors.h"

namespace bslam::python {
namespace {

using GivenMatrix = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;
using GivenMask = nb::ndarray<nb::ro, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

Pose pose_of(const GivenMatrix& rows) {
  Matrix4 matrix{};
  std::copy_n(rows.data(), matrix.size(), matrix.begin());
  return value_of(Pose::from_matrix(matrix));
}

// Masks of other types are errors: in those of floats, such as 0.5, a conversion would make zeros.
std::vector<std::uint8_t> mask_of(const GivenMask& mask, int width, int height) {
  if (mask.dtype() != nb::dtype<std::uint8_t>() && mask.dtype() != nb::dtype<bool>())
    raise({"Camera", "mask", "an array of another type", "an array of uint8 or bool"});
  if (mask.shape(0) != static_cast<std::size_t>(height) || mask.shape(1) != static_cast<std::size_t>(width)) {
    raise({"Camera", "mask", "shape (" + std::to_string(mask.shape(0)) + ", " + std::to_string(mask.shape(1)) + ")",
           "(" + std::to_string(height) + ", " + std::to_string(width) + ")"});
  }
  const auto* const values = static_cast<const std::uint8_t*>(mask.data());
  return {values, values + mask.size()};
}

std::optional<Array<std::uint8_t, -1, -1>> mask_array(const CameraCalibration& camera) {
  if (camera.mask.empty()) return std::nullopt;
  return make_array<Array<std::uint8_t, -1, -1>>(
      camera.mask, {static_cast<std::size_t>(camera.height), static_cast<std::size_t>(camera.width)});
}

template <class T>
T camera_argument(nb::handle object, const char* key, const char* expected) {
  return argument<T>(object, "Camera", key, expected);
}

CameraCalibration make_camera(nb::handle model, nb::handle resolution, nb::handle intrinsics, nb::handle distortion,
                              nb::handle T_body_cam, nb::handle name, nb::handle time_offset_s, nb::handle readout_s,
                              nb::handle mask) {
  CameraCalibration out;
  out.name = camera_argument<std::string>(name, "name", "a text");
  out.model = camera_argument<std::string>(model, "model", "the name of a model, such as pinhole");
  std::tie(out.width, out.height) =
      camera_argument<std::pair<int, int>>(resolution, "resolution", "two integers: width, height");
  out.intrinsics =
      camera_argument<std::array<double, 4>>(intrinsics, "intrinsics", "four numbers: fx, fy, cx, cy in pixels");
  if (!distortion.is_none())
    out.distortion = camera_argument<std::vector<double>>(distortion, "distortion", "a list of numbers");
  if (!T_body_cam.is_none())
    out.T_body_cam = pose_of(camera_argument<GivenMatrix>(T_body_cam, "T_body_cam", "an array of shape (4, 4)"));
  out.time_offset_s = camera_argument<double>(time_offset_s, "time_offset_s", "a number of seconds");
  out.rolling_shutter_readout_s =
      camera_argument<double>(readout_s, "rolling_shutter_readout_s", "a number of seconds");
  if (!mask.is_none())
    out.mask =
        mask_of(camera_argument<GivenMask>(mask, "mask", "an array of shape (height, width)"), out.width, out.height);
  return out;
}

std::vector<CameraCalibration> cameras_of(nb::handle list) {
  constexpr const char* kExpected = "a list of Camera; Rig.load(path) reads a calibration";
  check_sequence(list, "Rig", "cameras", kExpected);
  std::vector<CameraCalibration> out;
  for (std::size_t i = 0; i < nb::len(list); ++i) {
    const nb::object camera(list[i]);
    if (!nb::isinstance<CameraCalibration>(camera) || !nb::inst_ready(camera))
      raise({"Rig", "cameras[" + std::to_string(i) + "]", description_of(camera), "a Camera"});
    out.push_back(*nb::inst_ptr<CameraCalibration>(camera));
  }
  return out;
}

Rig load_rig(const std::filesystem::path& path, const std::optional<std::vector<int>>& cameras) {
  Rig rig = value_of(Rig::load(path));
  return cameras ? value_of(rig.subset(*cameras)) : rig;
}

CameraCalibration camera_at(const Rig& rig, std::ptrdiff_t i) {
  const auto size = static_cast<std::ptrdiff_t>(rig.size());
  if (i < -size || i >= size) throw nb::index_error("camera index out of range");
  return rig.camera(static_cast<std::size_t>(i < 0 ? i + size : i));
}

void bind_camera(nb::module_& module) {
  using C = CameraCalibration;
  nb::class_<C>(module, "Camera", "Calibration of one camera. Axes: x right, y down, z forward.")
      .def(
          "__init__",
          [](C* self, nb::handle model, nb::handle resolution, nb::handle intrinsics, nb::handle distortion,
             nb::handle T_body_cam, nb::handle name, nb::handle time_offset_s, nb::handle readout_s, nb::handle mask) {
            new (self) C(make_camera(model, resolution, intrinsics, distortion, T_body_cam, name, time_offset_s,
                                     readout_s, mask));
          },
          nb::kw_only(), nb::arg("model").none(), nb::arg("resolution").none(), nb::arg("intrinsics").none(),
          nb::arg("distortion").none() = nb::none(), nb::arg("T_body_cam").none() = nb::none(),
          nb::arg("name").none() = "", nb::arg("time_offset_s").none() = 0.0,
          nb::arg("rolling_shutter_readout_s").none() = 0.0, nb::arg("mask").none() = nb::none(),
          nb::sig("def __init__(self, *, model: str, resolution: tuple[int, int], "
                  "intrinsics: collections.abc.Sequence[float], "
                  "distortion: collections.abc.Sequence[float] | None = None, "
                  "T_body_cam: numpy.typing.NDArray[numpy.float64] | None = None, name: str = \"\", "
                  "time_offset_s: float = 0.0, rolling_shutter_readout_s: float = 0.0, "
                  "mask: numpy.typing.NDArray[numpy.uint8] | None = None) -> None"),
          "Creates a calibration. Names are those of the rig file of bslam.\n\n"
          "Args:\n"
          "    model: pinhole, pinhole-radtan, kannala-brandt, ucm, eucm, double-sphere or fov.\n"
          "    resolution: (width, height) in pixels.\n"
          "    intrinsics: fx, fy, cx, cy in pixels; pixel (0, 0) is the centre of the upper left pixel.\n"
          "    distortion: further parameters of the model.\n"
          "    T_body_cam: (4, 4), maps the camera to the body, metres; default: the identity.\n"
          "    name: unique in the rig; default: cam0, cam1, ... by index.\n"
          "    time_offset_s: true time = stamp + offset.\n"
          "    rolling_shutter_readout_s: seconds from the exposure of the first row to that of the last.\n"
          "    mask: uint8 or bool (height, width); 0 marks pixels to ignore in all images.")
      .def_ro("name", &C::name, "Name, unique in the rig.")
      .def_ro("model", &C::model, "pinhole, pinhole-radtan, kannala-brandt, ucm, eucm, double-sphere or fov.")
      .def_prop_ro(
          "resolution", [](const C& c) { return std::pair(c.width, c.height); }, "(width, height) in pixels.")
      .def_ro("intrinsics", &C::intrinsics, "fx, fy, cx, cy in pixels.")
      .def_ro("distortion", &C::distortion, "Further parameters of the model.")
      .def_prop_ro(
          "T_body_cam", [](const C& c) { return matrix_of(c.T_body_cam); }, nb::rv_policy::move, "(4, 4), metres.")
      .def_ro("time_offset_s", &C::time_offset_s, "True time = stamp + offset.")
      .def_ro("rolling_shutter_readout_s", &C::rolling_shutter_readout_s, "0: global shutter.")
      .def_prop_ro("mask", mask_array, nb::rv_policy::move,
                   "uint8 (height, width), 0 marks pixels to ignore; None if there is no mask.")
      .def("__repr__", [](const C& c) {
        return "Camera('" + c.name + "', " + c.model + ", " + std::to_string(c.width) + "x" + std::to_string(c.height) +
               ")";
      });
}

}  // namespace

void bind_rig(nb::module_& module) {
  bind_camera(module);
  nb::class_<Rig>(module, "Rig", "The calibrated cameras of a rig; immutable. Camera 0 is the reference of all poses.")
      .def(
          "__init__", [](Rig* self, nb::handle cameras) { new (self) Rig(value_of(Rig::make(cameras_of(cameras)))); },
          nb::arg("cameras").none(), nb::sig("def __init__(self, cameras: collections.abc.Sequence[Camera]) -> None"),
          "Creates a rig from calibrations; the first one is camera 0.")
      .def_static(
          "load", load_rig, nb::arg("path"), nb::arg("cameras") = nb::none(), nb::call_guard<nb::gil_scoped_release>(),
          "Reads a calibration of any known format, recognised by its content (bslam, EuRoC, Kalibr, OpenVINS,\n"
          "ORB-SLAM3, OKVIS2, Basalt, COLMAP, KITTI), or the calibration in the folder of a data set.\n\n"
          "Args:\n"
          "    path: file or folder.\n"
          "    cameras: indices of the cameras to use, in this order, as in `bslam run --cameras`; the first\n"
          "        becomes camera 0. Default: all.")
      .def(
          "subset", [](const Rig& rig, const std::vector<int>& cameras) { return value_of(rig.subset(cameras)); },
          nb::arg("cameras"), "Returns the rig of the given cameras, in this order; the first one becomes camera 0.")
      .def(
          "save", [](const Rig& rig, const std::filesystem::path& path) { check(rig.save(path)); }, nb::arg("path"),
          "Writes the rig file of bslam. Masks that were not loaded from files are written beside it, as\n"
          "NAME_mask0.png beside NAME.yaml for camera 0, and so on.")
      .def("__len__", &Rig::size)
      .def("__getitem__", camera_at, nb::arg("index"), "Returns the calibration of a camera.")
      .def_prop_ro(
          "cameras",
          [](const Rig& rig) {
            std::vector<CameraCalibration> out;
            for (std::size_t c = 0; c < rig.size(); ++c) out.push_back(rig.camera(c));
            return out;
          },
          "Calibrations of all cameras.")
      .def_prop_ro("notes", &Rig::notes, "How ambiguous content of the file was interpreted, one line each.")
      .def_prop_ro("warnings", &Rig::warnings, "Likely mistakes in units, frames or axes, one line each.")
      .def("__repr__", [](const Rig& rig) { return "Rig of " + std::to_string(rig.size()) + " cameras"; });
}

}  // namespace bslam::python
