// Matching of one frame at full size: 1200 keypoints per camera, 3000 landmarks in view.
#include <benchmark/benchmark.h>

#include "../tests/mapping/simulated_map.h"
#include "map/local_view.h"
#include "matching/epipolar_search.h"
#include "matching/patch_alignment.h"
#include "matching/projection_search.h"

namespace bslam::frame {
namespace {

const map::SimulatedMap& world() {
  static const map::SimulatedMap world = [] {
    synthetic::FeatureSimulatorOptions options;
    options.landmarks = 20000;
    options.max_keypoints = 1143;  // and 5 % outliers
    map::SimulatedMap out(synthetic::FeatureSimulator(synthetic::default_rig(), synthetic::make_orbit({}), options));
    for (int i = 0; i < 24; ++i) out.add_keyframe(FrameId(i), 0.25 * i);
    return out;
  }();
  return world;
}

void MatchEpipolar(benchmark::State& state) {
  const camera::Rig& rig = world().map.rig();
  const BundledFrame& frame = world().frames[3].frame;
  const matching::EpipolarView a{&rig.camera(0), &frame.cameras[0].keypoints, rig.rig_from_cam(0), {}};
  const matching::EpipolarView b{&rig.camera(1), &frame.cameras[1].keypoints, rig.rig_from_cam(1), {}};
  std::size_t matches = 0;
  for (auto _ : state) matches = matching::match_epipolar(a, b, {}).size();
  state.counters["keypoints"] = static_cast<double>(frame.cameras[0].keypoints.size());
  state.counters["matches"] = static_cast<double>(matches);
}
BENCHMARK(MatchEpipolar)->Unit(benchmark::kMicrosecond);

void SearchByProjection(benchmark::State& state) {
  const auto& seen = world().frames[5];
  const geometry::SE3 T_cam_world = world().map.rig().cam_from_rig(0) * seen.T_world_rig.inverse();
  std::vector<matching::SearchPoint> points;
  for (const LandmarkId id : world().map.landmark_ids()) {
    if (points.size() == 3000) break;
    const map::Landmark& l = world().map.landmark(id);
    points.push_back({l.position, l.view_direction, l.min_distance, l.max_distance, &l.descriptor});
  }
  std::size_t matches = 0;
  for (auto _ : state) {
    matches = matching::search_by_projection(world().map.rig(), CameraIndex(0), seen.frame.cameras[0], T_cam_world,
                                             points, {}, {.radius = 0.006})
                  .matches.size();
  }
  state.counters["points"] = static_cast<double>(points.size());
  state.counters["matches"] = static_cast<double>(matches);
}
BENCHMARK(SearchByProjection)->Unit(benchmark::kMicrosecond);

// A wave pattern, shifted by half a pixel and slightly rotated.
void AlignPatch(benchmark::State& state) {
  const auto grey = [](double x, double y) {
    return static_cast<std::uint8_t>(128 + 50 * std::sin(0.5 * x + 0.2 * y) + 40 * std::cos(0.45 * y));
  };
  image::Image image(160, 120);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) image.row(y)[x] = grey(x - 80, y - 60);
  }
  image::Pyramid pyramid;
  image::build_pyramid(image.view(), 8, 1.2, pyramid);
  feature::Patch patch;
  for (int y = 0; y < feature::kPatchSize; ++y) {
    for (int x = 0; x < feature::kPatchSize; ++x) {
      patch[static_cast<std::size_t>(y * feature::kPatchSize + x)] = grey(x - 4.5, y - 4.5);
    }
  }
  const matching::PatchWarp warp{Eigen::Rotation2Dd(0.05).toRotationMatrix()};
  bool found = false;
  for (auto _ : state) found = matching::align_patch(patch, warp, pyramid, {80.5, 59.6}, {}).has_value();
  state.counters["found"] = found;
}
BENCHMARK(AlignPatch)->Unit(benchmark::kNanosecond);

void LocalLandmarks(benchmark::State& state) {
  const map::BundledMap& map = world().map;
  std::vector<LandmarkId> seeds;
  for (const LandmarkId l : map.keyframe(KeyframeId(12)).landmarks) {
    if (l.valid()) seeds.push_back(l);
  }
  std::size_t landmarks = 0;
  for (auto _ : state) landmarks = map::local_landmarks(map, seeds, KeyframeId(12), {}).size();
  state.counters["seeds"] = static_cast<double>(seeds.size());
  state.counters["landmarks"] = static_cast<double>(landmarks);
}
BENCHMARK(LocalLandmarks)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace bslam::frame
