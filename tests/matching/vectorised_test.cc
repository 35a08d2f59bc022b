// The versions of vectorised functions give the bits of the default one: the sources are compiled here once more, under
// other names and with the default version only.
#include "base/vectorised.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "feature/smoothing.h"
#include "feature/window.h"
#include "image/pyramid.h"
#include "matching/patch_alignment.h"

#undef BSLAM_VECTORISED
#define BSLAM_VECTORISED
#define align_patch align_patch_default
#define patch_warp patch_warp_default
#include "matching/patch_alignment.cc"
#undef align_patch
#undef patch_warp
#define build_pyramid build_pyramid_default
#include "image/pyramid.cc"
#undef build_pyramid
#define sample_window sample_window_default
#define sample_patch sample_patch_default
#include "feature/window.cc"
#undef sample_window
#undef sample_patch
#define Smoother DefaultSmoother
namespace bslam::feature {
class DefaultSmoother {
 public:
  void soften(const image::ImageView& in, image::Image& out);
  void smooth(const image::ImageView& in, image::Image& out);

 private:
  template <class Kernel>
  void filter(const image::ImageView& in, image::Image& out);
  std::vector<std::uint16_t> row_;
};
}  // namespace bslam::feature
#include "feature/smoothing.cc"
#undef Smoother

namespace bslam {
namespace {

image::Image noise(int width, int height) {
  Random random(3, "noise");
  image::Image out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.row(y)[x] = static_cast<std::uint8_t>(random.below(256));
  }
  return out;
}

bool same(const image::Image& a, const image::Image& b) {
  if (a.width() != b.width() || a.height() != b.height()) return false;
  for (int y = 0; y < a.height(); ++y) {
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width())) != 0) return false;
  }
  return true;
}

TEST(Vectorised, PyramidsAndSmoothedImagesAreThoseOfTheDefaultVersion) {
  for (const int width : {33, 64, 517, 751}) {
    const image::Image image = noise(width, 97);
    image::Pyramid a, b;
    image::build_pyramid(image.view(), 8, 1.2, a);
    image::build_pyramid_default(image.view(), 8, 1.2, b);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t l = 0; l < a.size(); ++l) EXPECT_TRUE(same(a.levels[l], b.levels[l])) << width << " " << l;
    feature::Smoother smoother;
    feature::DefaultSmoother plain;
    image::Image of_any, of_default;
    smoother.soften(image.view(), of_any);
    plain.soften(image.view(), of_default);
    EXPECT_TRUE(same(of_any, of_default)) << width;
    smoother.smooth(image.view(), of_any);
    plain.smooth(image.view(), of_default);
    EXPECT_TRUE(same(of_any, of_default)) << width;
  }
}

TEST(Vectorised, WindowsAndAlignedPatchesAreThoseOfTheDefaultVersion) {
  image::Pyramid pyramid;
  feature::Smoother smoother;
  image::Image image;
  smoother.smooth(noise(320, 240).view(), image);
  image::build_pyramid(image.view(), 4, 1.2, pyramid);
  Random random(5, "keypoints");
  int aligned = 0;
  for (int i = 0; i < 500; ++i) {
    const auto x = static_cast<float>(random.uniform(40, 280)), y = static_cast<float>(random.uniform(40, 200));
    EXPECT_EQ(feature::sample_window(image.view(), x, y), feature::sample_window_default(image.view(), x, y));
    const feature::Patch patch = feature::sample_patch(image.view(), x, y);
    matching::PatchWarp warp;
    warp.linear << random.uniform(0.8, 1.3), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1),
        random.uniform(0.8, 1.3);
    warp.quadratic.setConstant(random.uniform(-0.002, 0.002));
    const Eigen::Vector2d initial(x + random.uniform(-0.6, 0.6), y + random.uniform(-0.6, 0.6));
    const auto a = matching::align_patch(patch, warp, pyramid, initial, {}),
               b = matching::align_patch_default(patch, warp, pyramid, initial, {});
    ASSERT_EQ(a.has_value(), b.has_value()) << i;
    if (!a) continue;
    ++aligned;
    EXPECT_EQ(a->pixel, b->pixel) << i;
    EXPECT_EQ(a->sigma, b->sigma) << i;
  }
  EXPECT_GT(aligned, 100);
}

}  // namespace
}  // namespace bslam
