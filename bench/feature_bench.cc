// Time of feature extraction and its parts on 752 x 480 images. With BSLAM_BENCH_IMAGES=FOLDER, images of a folder
// (every tenth, at most 16) are used instead of a synthetic one.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "base/random.h"
#include "feature/brief_pattern.h"
#include "feature/distribution.h"
#include "feature/extractor.h"
#include "feature/fast.h"
#include "feature/orientation.h"
#include "feature/smoothing.h"
#include "feature/subpixel.h"
#include "feature/window.h"

namespace bslam::feature {
namespace {

image::Image synthetic_image() {
  image::Image image(752, 480);
  Random random(1, "bench");
  for (int y = 0; y < image.height(); ++y) std::fill_n(image.row(y), image.width(), std::uint8_t{120});
  for (int i = 0; i < 900; ++i) {  // overlapping rectangles
    const int x = static_cast<int>(random.below(752)), y = static_cast<int>(random.below(480));
    const int w = 4 + static_cast<int>(random.below(60)), h = 4 + static_cast<int>(random.below(60));
    const auto grey = static_cast<std::uint8_t>(20 + random.below(216));
    for (int r = y; r < std::min(y + h, 480); ++r) std::fill_n(image.row(r) + x, std::min(w, 752 - x), grey);
  }
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(image.row(y)[x] + 2.0 * random.normal(), 0.0, 255.0));
    }
  }
  return image;
}

std::vector<image::Image> read_images(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().string());
  std::sort(names.begin(), names.end());
  std::vector<image::Image> images;
  for (std::size_t i = 0; i < names.size() && images.size() < 16; i += names.size() > 50 ? 10 : 1) {
    const cv::Mat grey = cv::imread(names[i], cv::IMREAD_GRAYSCALE);
    if (grey.empty()) continue;
    image::Image& image = images.emplace_back(grey.cols, grey.rows);
    for (int y = 0; y < grey.rows; ++y) std::copy_n(grey.ptr(y), grey.cols, image.row(y));
  }
  return images;
}

const std::vector<image::Image>& test_images() {
  static const std::vector<image::Image> images = [] {
    std::vector<image::Image> found;
    if (const char* folder = std::getenv("BSLAM_BENCH_IMAGES")) found = read_images(folder);
    if (found.empty()) found.push_back(synthetic_image());
    return found;
  }();
  return images;
}

camera::Camera test_camera(int width, int height) {
  camera::PinholeRadTan model({458.654, 457.296, 367.215, 248.375},
                              {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  return {.name = "cam0", .model = model, .width = width, .height = height, .time_offset_ns = 0, .mask_file = ""};
}

void extract_image(benchmark::State& state) {
  FeatureOptions options;
  options.per_image = static_cast<int>(state.range(0));
  Extractor extractor(options);
  const camera::Camera camera = test_camera(test_images()[0].width(), test_images()[0].height());
  image::Pyramid pyramid;
  Detections keypoints;
  std::size_t i = 0, total = 0;
  for (auto _ : state) {
    extractor.extract(test_images()[i++ % test_images().size()].view(), {}, camera, pyramid, keypoints);
    total += keypoints.size();
  }
  state.counters["keypoints"] = static_cast<double>(total) / static_cast<double>(state.iterations());
}
BENCHMARK(extract_image)->Arg(600)->Arg(1200)->Arg(2400)->Unit(benchmark::kMillisecond);

image::Pyramid test_pyramid() {
  image::Pyramid pyramid;
  build_pyramid(test_images()[0].view(), 8, 1.2, pyramid);
  return pyramid;
}

void build_image_pyramid(benchmark::State& state) {
  image::Pyramid pyramid;
  for (auto _ : state) build_pyramid(test_images()[0].view(), 8, 1.2, pyramid);
}
BENCHMARK(build_image_pyramid)->Unit(benchmark::kMicrosecond);

void detect_all_levels(benchmark::State& state) {
  const image::Pyramid pyramid = test_pyramid();
  FastDetector detector;
  std::vector<Corner> corners;
  std::size_t count = 0;
  for (auto _ : state) {
    count = 0;
    for (const image::Image& level : pyramid.levels) {
      detector.detect(level.view(), 17, static_cast<int>(state.range(0)), corners);
      count += corners.size();
    }
  }
  state.counters["corners"] = static_cast<double>(count);
}
BENCHMARK(detect_all_levels)->Arg(5)->Arg(20)->Unit(benchmark::kMicrosecond);

void spread_level_0(benchmark::State& state) {
  const image::Image& image = test_images()[0];
  const Region region{17, 17, image.width() - 34, image.height() - 34};
  FastDetector detector;
  Distribution distribution(380);
  std::vector<Corner> corners, chosen;
  std::vector<std::uint32_t> ranked;
  detector.detect(image.view(), 17, 5, corners);
  for (auto _ : state) {
    distribution.non_maximum_suppression(corners, region, 9, ranked);
    distribution.choose(corners, ranked, region, 380, 20, chosen);
  }
  state.counters["corners"] = static_cast<double>(corners.size());
}
BENCHMARK(spread_level_0)->Unit(benchmark::kMicrosecond);

void smooth_all_levels(benchmark::State& state) {
  const image::Pyramid pyramid = test_pyramid();
  Smoother smoother;
  image::Image out;
  for (auto _ : state) {
    for (const image::Image& level : pyramid.levels) smoother.smooth(level.view(), out);
  }
}
BENCHMARK(smooth_all_levels)->Unit(benchmark::kMicrosecond);

template <class Step>
void per_keypoint(benchmark::State& state, const Step& step) {
  const image::Image& image = test_images()[0];
  std::uint32_t k = 0;
  for (auto _ : state) {
    k = k * 1664525u + 1013904223u;
    step(image.view(), 20 + static_cast<int>((k >> 8) % static_cast<std::uint32_t>(image.width() - 40)),
         20 + static_cast<int>((k >> 20) % static_cast<std::uint32_t>(image.height() - 40)));
  }
}

void refine_corner(benchmark::State& state) {
  per_keypoint(state, [](const image::ImageView& i, int x, int y) { benchmark::DoNotOptimize(refine(i, x, y)); });
}
BENCHMARK(refine_corner);

void orient_corner(benchmark::State& state) {
  per_keypoint(state, [](const image::ImageView& i, int x, int y) {
    const Window window = sample_window(i, static_cast<float>(x) + 0.3f, static_cast<float>(y));
    benchmark::DoNotOptimize(orientation(intensity_moments(window)));
  });
}
BENCHMARK(orient_corner);

void describe_corner(benchmark::State& state) {
  const Describer describer;
  per_keypoint(state, [&](const image::ImageView& i, int x, int y) {
    const Window window = sample_window(i, static_cast<float>(x) + 0.3f, static_cast<float>(y));
    benchmark::DoNotOptimize(describer.describe(window, 0.01f * static_cast<float>(x)));
  });
}
BENCHMARK(describe_corner);

void sample_corner_patch(benchmark::State& state) {
  per_keypoint(state, [](const image::ImageView& i, int x, int y) {
    benchmark::DoNotOptimize(sample_patch(i, static_cast<float>(x) + 0.3f, static_cast<float>(y) - 0.2f));
  });
}
BENCHMARK(sample_corner_patch);

void unproject_pixel(benchmark::State& state) {
  const camera::Camera camera = test_camera(752, 480);
  per_keypoint(state, [&](const image::ImageView&, int x, int y) {
    benchmark::DoNotOptimize(camera.unproject(Eigen::Vector2d(x, y)));
  });
}
BENCHMARK(unproject_pixel);

void make_tests(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(make_brief_pattern());
}
BENCHMARK(make_tests)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace bslam::feature
