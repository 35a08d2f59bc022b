// Counts the allocations of extraction, which must be zero after the first image.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "feature/extractor.h"
#include "synthetic_scene.h"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined, because the compiler would warn about free() of memory from operator new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
// The default version of the library calls the operator above; that of a sanitizer does not.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace bslam::feature {
namespace {

TEST(Extractor, AllocatesNoMemoryAfterTheFirstImage) {
  const cv::Mat scene = testing::make_scene(1500, 1000, 2);
  const cv::Size size(640, 480);
  Extractor extractor{FeatureOptions{}};
  image::Pyramid pyramid;
  Detections keypoints;
  const camera::Camera camera = testing::pinhole_camera(size);
  const auto run = [&](const cv::Mat& view) {
    const long before = allocations;
    extractor.extract(testing::view_of(view), {}, camera, pyramid, keypoints);
    return allocations - before;
  };
  EXPECT_GT(run(cv::Mat(size, CV_8U, cv::Scalar(50))), 0);  // the first image allocates all memory, even if it is blank
  EXPECT_EQ(run(testing::render(scene, {0, 1, 0, 0, size}, 0, 0.3, 0, 2)), 0);
  EXPECT_EQ(run(testing::render(scene, {0, 1, 0, 0, size}, 0, 1, 0, 2)), 0);
  EXPECT_EQ(run(testing::render(scene, {1, 1, 5, 5, size}, 0, 1, 0, 30)), 0);
  EXPECT_FALSE(keypoints.empty());
}

}  // namespace
}  // namespace bslam::feature
