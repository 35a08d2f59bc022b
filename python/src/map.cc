// The class Map.
#include <bslam/map_view.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include "arrays.h"
#include "bindings.h"
#include "errors.h"

namespace bslam::python {
namespace {

// Returns one integer of each element.
template <class Elements, class Member>
Integers column(const Elements& elements, Member member) {
  std::vector<std::int64_t> out;
  out.reserve(elements.size());
  for (const auto& element : elements) out.push_back(static_cast<std::int64_t>(element.*member));
  return make_array<Integers>(std::move(out), {elements.size()});
}

Array<double, -1, 4, 4> poses(const MapView& map) {
  const std::vector<MapView::Keyframe> keyframes = map.keyframes();
  std::vector<double> out;
  out.reserve(16 * keyframes.size());
  for (const MapView::Keyframe& keyframe : keyframes) {
    const Matrix4 matrix = keyframe.T_world_cam0.matrix();
    out.insert(out.end(), matrix.begin(), matrix.end());
  }
  return make_array<Array<double, -1, 4, 4>>(std::move(out), {keyframes.size(), 4, 4});
}

Rows3 landmarks(const MapView& map) {
  const std::vector<MapView::Landmark> landmarks = map.landmarks();
  std::vector<double> out;
  out.reserve(3 * landmarks.size());
  for (const MapView::Landmark& landmark : landmarks) {
    out.insert(out.end(), landmark.position.begin(), landmark.position.end());
  }
  return make_array<Rows3>(std::move(out), {landmarks.size(), 3});
}

Array<std::int64_t, -1, 3> covisibility(const MapView& map, int min_landmarks) {
  if (min_landmarks < 1) raise({"Map.covisibility", "min_landmarks", std::to_string(min_landmarks), "1 or more"});
  const std::vector<MapView::CovisibilityEdge> edges = map.covisibility(min_landmarks);
  std::vector<std::int64_t> out;
  out.reserve(3 * edges.size());
  for (const MapView::CovisibilityEdge& e : edges) out.insert(out.end(), {e.first, e.second, e.landmarks});
  return make_array<Array<std::int64_t, -1, 3>>(std::move(out), {edges.size(), 3});
}

void bind_keyframes(nb::class_<MapView>& map) {
  using Keyframe = MapView::Keyframe;
  map.def_prop_ro(
         "keyframe_ids", [](const MapView& m) { return column(m.keyframes(), &Keyframe::id); }, nb::rv_policy::move,
         "(k,) ids of the keyframes, ascending; all arrays of keyframes have this order.")
      .def_prop_ro(
          "keyframe_times_ns", [](const MapView& m) { return column(m.keyframes(), &Keyframe::time_ns); },
          nb::rv_policy::move, "(k,) times of their frames in nanoseconds.")
      .def_prop_ro(
          "keyframe_parents", [](const MapView& m) { return column(m.keyframes(), &Keyframe::parent); },
          nb::rv_policy::move, "(k,) ids of their parents in the spanning tree of the submap; -1 for a root.")
      .def_prop_ro(
          "keyframe_submaps", [](const MapView& m) { return column(m.keyframes(), &Keyframe::submap); },
          nb::rv_policy::move, "(k,) ids of their submaps, which are those of the root keyframes.")
      .def_prop_ro("poses", poses, nb::rv_policy::move,
                   "(k, 4, 4) T_world_cam0 of the keyframes, in the world frames of their submaps.")
      .def(
          "words",
          [](const MapView& m) {
            nb::list out;
            for (std::vector<std::int32_t>& words : m.words()) {
              const std::size_t size = words.size();
              out.append(make_array<Array<std::int32_t, -1>>(std::move(words), {size}));
            }
            return out;
          },
          "Returns, for each keyframe, the distinct visual words of its features, ascending: arrays of shape (M,).",
          nb::sig("def words(self) -> list[numpy.typing.NDArray[numpy.int32]]"))
      .def(
          "covisibility", covisibility, nb::arg("min_landmarks") = 15,
          "Returns the pairs of keyframes with at least `min_landmarks` common landmarks, (e, 3): the ids of both, the "
          "smaller one first, and the number of common landmarks.");
}

void bind_landmarks(nb::class_<MapView>& map) {
  using Landmark = MapView::Landmark;
  map.def_prop_ro("landmarks", landmarks, nb::rv_policy::move,
                  "(m, 3) positions in the world frames of their submaps, in metres if the scale is metric.")
      .def_prop_ro(
          "landmark_ids", [](const MapView& m) { return column(m.landmarks(), &Landmark::id); }, nb::rv_policy::move,
          "(m,) ids of the landmarks, ascending; all arrays of landmarks have this order.")
      .def_prop_ro(
          "landmark_observations", [](const MapView& m) { return column(m.landmarks(), &Landmark::observations); },
          nb::rv_policy::move, "(m,) numbers of keyframes that observe them.")
      .def_prop_ro(
          "landmark_submaps", [](const MapView& m) { return column(m.landmarks(), &Landmark::submap); },
          nb::rv_policy::move, "(m,) ids of their submaps.");
}

}  // namespace

void bind_map(nb::module_& module) {
  nb::class_<MapView> map(module, "Map",
                          "An immutable version of a map, which does not change while the System continues. Every "
                          "array is a new copy: keep it instead of asking again in a loop.");
  map.def_static(
         "load", [](const std::filesystem::path& path) { return value_of(MapView::load(path)); }, nb::arg("path"),
         nb::call_guard<nb::gil_scoped_release>(),
         "Reads a saved map. Keyframes and landmarks were renumbered when it was saved.")
      .def_prop_ro("version", &MapView::version, "Incremented by every change; 0 for a loaded map.")
      .def_prop_ro(
          "scale", [](const MapView& m) { return to_string(m.scale()); },
          "metric: lengths are metres; up-to-scale or unobservable: they are in the unit of the map.")
      .def_prop_ro("rig", &MapView::rig, "The rig of the map, without masks.")
      .def_prop_ro("num_keyframes", &MapView::num_keyframes, "Number of keyframes, k.")
      .def_prop_ro("num_landmarks", &MapView::num_landmarks, "Number of landmarks, m.")
      .def_prop_ro("num_observations", &MapView::num_observations,
                   "Number of keypoints of keyframes that observe a landmark.")
      .def_prop_ro(
          "submaps", [](const MapView& m) { return column(m.submaps(), &MapView::Submap::root); }, nb::rv_policy::move,
          "(s,) ids of the submaps: connected parts of the map, each with its own world frame.")
      .def("__repr__", [](const MapView& m) {
        return "Map of " + std::to_string(m.num_keyframes()) + " keyframes and " + std::to_string(m.num_landmarks()) +
               " landmarks";
      });
  bind_keyframes(map);
  bind_landmarks(map);
}

}  // namespace bslam::python
