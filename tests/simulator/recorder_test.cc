#include "simulator/recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "simulator/tour.h"
#include "small_world.h"
#include "synthetic/rigs.h"

namespace bslam::simulator {
namespace {

std::vector<std::uint8_t> bytes_of(const image::Image& image) {
  return {image.row(0), image.row(0) + image.width() * image.height()};
}

double mean_of(const image::Image& image) {
  double sum = 0;
  for (const std::uint8_t v : bytes_of(image)) sum += v;
  return sum / (image.width() * image.height());
}

// Returns the mean difference of neighbouring pixels in a row.
double roughness_of(const image::Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 1; x < image.width(); ++x) sum += std::abs(image.row(y)[x] - image.row(y)[x - 1]);
  }
  return sum / (image.height() * (image.width() - 1));
}

std::vector<std::vector<std::uint8_t>> record(std::uint64_t seed, int threads) {
  ThreadPool pool(threads);
  const World world = small_world(seed, pool);
  const camera::Rig rig = synthetic::ring_rig(3, 96);
  const RecordingOptions options{.duration_s = 1, .rate_hz = 3};
  const Recorder recorder(world, rig, make_tour(world.building(), {.duration_s = 1, .seed = seed}), {.seed = seed},
                          0.005, pool);
  const std::vector<Shot> shots = plan_shots(rig, options);
  std::vector<std::vector<std::uint8_t>> images(shots.size());
  pool.for_each(shots.size(), [&](std::size_t i) { images[i] = bytes_of(recorder.render(shots[i])); });
  return images;
}

TEST(Recorder, IsIdenticalWithAnyNumberOfThreads) {
  const auto once = record(1, 1), again = record(1, 2), other = record(2, 2);
  EXPECT_EQ(once, again);
  ASSERT_EQ(once.size(), 9u);
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_NE(once[i], other[i]);
}

// Points visible in one image have the same appearance at their true position in the image of the other camera.
TEST(Recorder, AgreesWithGroundTruthAcrossCamerasAndTime) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const camera::Rig rig = synthetic::ring_rig(2, 376);
  const Recorder recorder(world, rig, make_tour(world.building(), {}), {.vignetting = 0, .noise = 0}, 0.0, pool);
  const auto shot = [](std::size_t camera, double time_s) {
    Shot s;
    s.camera = camera;
    s.scene_time_s = time_s;
    return s;
  };
  const Shot from = shot(0, 3.0);
  const image::Image rendered = recorder.render(from);
  for (const Shot& to : {shot(1, 3.0), shot(0, 3.3), shot(1, 3.3)}) {
    const image::Image other = recorder.render(to);
    const geometry::SE3 T_world_from = recorder.T_world_cam(0, from.scene_time_s);
    const geometry::SE3 T_world_to = recorder.T_world_cam(to.camera, to.scene_time_s);
    double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
    for (int y = 5; y < rendered.height() - 5; y += 3) {
      for (int x = 5; x < rendered.width() - 5; x += 3) {
        const Vector3d ray = T_world_from.rotation() * *rig.camera(std::size_t{0}).unproject({x, y});
        const auto hit = world.cast(T_world_from.translation(), ray);
        ASSERT_TRUE(hit.has_value());
        const Vector3d point = T_world_from.translation() + hit->distance * ray;
        const auto pixel = rig.camera(to.camera).project(T_world_to.inverse() * point);
        if (!pixel || !rig.camera(to.camera).contains(*pixel, 2)) continue;
        const Vector3d back = point - T_world_to.translation();
        const auto seen = world.cast(T_world_to.translation(), back.normalized());
        if (!seen || std::abs(seen->distance - back.norm()) > 0.005) continue;  // occluded in the other camera
        const int u = static_cast<int>(pixel->x()), v = static_cast<int>(pixel->y());
        const double fx = pixel->x() - u, fy = pixel->y() - v;
        const double b = (1 - fy) * ((1 - fx) * other.row(v)[u] + fx * other.row(v)[u + 1]) +
                         fy * ((1 - fx) * other.row(v + 1)[u] + fx * other.row(v + 1)[u + 1]);
        const double a = rendered.row(y)[x];
        n += 1, sa += a, sb += b, saa += a * a, sbb += b * b, sab += a * b;
      }
    }
    ASSERT_GT(n, 1000);
    const double correlation = (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
    EXPECT_GT(correlation, 0.93);
    EXPECT_NEAR(sa / n, sb / n, 2.0);
  }
}

// Each row is that of the image that a global shutter takes at the time of the row.
TEST(Recorder, RowsOfARollingShutterAreExposedAtTheirTimes) {
  constexpr double kReadout_s = 0.06;
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const camera::Rig global = synthetic::ring_rig(1, 96);
  camera::RigCamera camera{global.camera(std::size_t{0}), global.body_from_cam(0)};
  camera.camera.readout_s = kReadout_s;
  const synthetic::Trajectory tour = make_tour(world.building(), {});
  const Recorder rolling(world, camera::Rig({camera}), tour, {}, 0.005, pool);
  const Recorder reference(world, global, tour, {}, 0.005, pool);
  Shot shot;
  shot.scene_time_s = 3;
  const image::Image image = rolling.render(shot), middle = reference.render(shot);
  int different = 0;
  for (const int y : {0, image.height() / 3, image.height() - 1}) {
    Shot of_row = shot;
    of_row.scene_time_s += kReadout_s * (y / (image.height() - 1.0) - 0.5);
    const image::Image expected = reference.render(of_row);
    for (int x = 0; x < image.width(); ++x) {
      ASSERT_EQ(image.row(y)[x], expected.row(y)[x]) << x << " " << y;
      different += image.row(y)[x] != middle.row(y)[x];
    }
  }
  EXPECT_GT(different, image.width());
}

TEST(Recorder, HasReasonableExposure) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const camera::Rig rig = synthetic::ring_rig(4, 188);
  const Recorder recorder(world, rig, make_tour(world.building(), {}), {}, 0.005, pool);
  for (double time = 0; time < 20; time += 4) {
    for (std::size_t c = 0; c < rig.size(); ++c) {
      Shot shot;
      shot.camera = c;
      shot.scene_time_s = time;
      const image::Image rendered = recorder.render(shot);
      EXPECT_GT(mean_of(rendered), 65);
      EXPECT_LT(mean_of(rendered), 150);
      const auto bytes = bytes_of(rendered);
      EXPECT_LT(std::count(bytes.begin(), bytes.end(), 255), static_cast<std::ptrdiff_t>(bytes.size() / 20));
    }
  }
}

TEST(PlanShots, StampsFramesAtTheRate) {
  const camera::Rig rig = synthetic::ring_rig(2, 96);
  const RecordingOptions options{.duration_s = 0.3, .rate_hz = 10};
  const std::vector<Shot> shots = plan_shots(rig, options);
  ASSERT_EQ(shots.size(), 6u);
  EXPECT_EQ(shots[0].stamp_ns, 1'000'000'000);
  EXPECT_EQ(shots[3].stamp_ns, 1'100'000'000);
  EXPECT_EQ(shots[3].camera, 1u);
  EXPECT_NEAR(shots[3].scene_time_s, 0.1, 1e-12);
}

TEST(PlanShots, ShiftsTheSceneByTheTimeOffset) {
  const camera::Rig plain = synthetic::ring_rig(1, 96);
  camera::RigCamera camera{plain.camera(std::size_t{0}), plain.body_from_cam(0)};
  camera.camera.time_offset_ns = 4'000'000;
  const std::vector<Shot> shots = plan_shots(camera::Rig({camera}), {.duration_s = 0.2, .rate_hz = 10});
  EXPECT_EQ(shots[1].stamp_ns, 1'100'000'000);
  EXPECT_NEAR(shots[1].scene_time_s, 0.104, 1e-12);
}

TEST(PlanShots, AppliesFaultsToTheirCamerasAndTimes) {
  const camera::Rig rig = synthetic::ring_rig(3, 96);
  RecordingOptions options{.duration_s = 1, .rate_hz = 10};
  options.faults = {{FaultType::kBlack, {0}, 0.2, 0.4, 0},
                    {FaultType::kFrozen, {1}, 0.3, 0.6, 0},
                    {FaultType::kDropped, {2, 0}, 0.5, 0.7, 0},
                    {FaultType::kDelayed, {1}, 0.8, 1.0, 0.15}};
  const std::vector<Shot> shots = plan_shots(rig, options);
  const auto at = [&](std::size_t frame, std::size_t camera) { return shots[frame * 3 + camera]; };
  for (std::size_t f = 0; f < 10; ++f) {
    EXPECT_EQ(at(f, 0).exposure == 0, f == 2 || f == 3) << f;
    EXPECT_EQ(at(f, 0).written, f != 5 && f != 6) << f;
    EXPECT_EQ(at(f, 2).written, f != 5 && f != 6) << f;
    const bool frozen = f >= 3 && f < 6;
    EXPECT_EQ(at(f, 1).fault == FaultType::kFrozen, frozen) << f;
    EXPECT_NEAR(at(f, 1).scene_time_s,
                frozen   ? 0.2
                : f >= 8 ? 0.1 * static_cast<double>(f) - 0.15
                         : 0.1 * static_cast<double>(f),
                1e-9);
    EXPECT_EQ(at(f, 1).noise_key, (frozen ? 2 : f) * 3 + 1);
  }
}

TEST(Recorder, ShowsFaults) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const camera::Rig rig = synthetic::ring_rig(1, 188);
  RecordingOptions options{.duration_s = 1, .rate_hz = 6};
  options.faults = {{FaultType::kFrozen, {0}, 0.15, 0.4, 0},
                    {FaultType::kBlack, {0}, 0.45, 0.55, 0},
                    {FaultType::kOverExposed, {0}, 0.6, 0.7, 0},
                    {FaultType::kBlurred, {0}, 0.75, 0.9, 0}};
  const Recorder recorder(world, rig, make_tour(world.building(), {.duration_s = 1}), {}, 0.005, pool);
  const std::vector<Shot> shots = plan_shots(rig, options);
  const auto rendered = [&](std::size_t i) { return bytes_of(recorder.render(shots[i])); };
  EXPECT_EQ(rendered(0), rendered(1));
  EXPECT_EQ(rendered(0), rendered(2));
  EXPECT_EQ(mean_of(recorder.render(shots[3])), 0.0);
  const auto bright = rendered(4);
  EXPECT_GT(std::count_if(bright.begin(), bright.end(), [](std::uint8_t v) { return v >= 250; }),
            static_cast<std::ptrdiff_t>(0.6 * static_cast<double>(bright.size())));
  // A smeared lens preserves the mean intensity and reduces the differences between neighbouring pixels.
  Shot sharp = shots[5];
  EXPECT_GT(sharp.blur_px, 0);
  sharp.blur_px = 0;
  const image::Image blurred = recorder.render(shots[5]), as_usual = recorder.render(sharp);
  EXPECT_NEAR(mean_of(blurred), mean_of(as_usual), 0.05 * mean_of(as_usual));
  EXPECT_LT(roughness_of(blurred), 0.5 * roughness_of(as_usual));
  EXPECT_NE(bytes_of(as_usual), rendered(0));
}

TEST(Fault, NamesRoundTrip) {
  for (const FaultType type : {FaultType::kBlack, FaultType::kFrozen, FaultType::kOverExposed, FaultType::kDropped,
                               FaultType::kDelayed, FaultType::kBlurred}) {
    EXPECT_EQ(fault_type(fault_name(type)), type);
  }
  EXPECT_FALSE(fault_type("cracked").has_value());
}

}  // namespace
}  // namespace bslam::simulator
