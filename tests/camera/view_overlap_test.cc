#include "camera/view_overlap.h"

#include <gtest/gtest.h>

#include "camera/stereo_rig.h"

namespace bslam::camera {
namespace {

constexpr std::size_t kCells = UsedView::kColumns * UsedView::kRows;

TEST(UsedView, ConsistsOfTheCellsAroundPixels) {
  const Camera camera = stereo_rig().camera(0u);
  UsedView view(camera);
  EXPECT_EQ(view.size(), 0u);
  EXPECT_EQ(UsedView::all_of(camera).size(), kCells);
  view.add({0, 0});  // in a corner, with three neighbours
  EXPECT_EQ(view.size(), 4u);
  view.add({camera.width - 1.0, camera.height - 1.0});
  EXPECT_EQ(view.size(), 8u);
  EXPECT_TRUE(view.contains(UsedView::kColumns - 2, UsedView::kRows - 2));
  EXPECT_FALSE(view.contains(UsedView::kColumns - 3, UsedView::kRows - 1));
  view.add(view.centre(10, 7));
  EXPECT_EQ(view.size(), 17u);
  for (std::size_t row = 6; row <= 8; ++row) {
    for (std::size_t column = 9; column <= 11; ++column) EXPECT_TRUE(view.contains(view.centre(column, row)));
  }
}

// Both cameras observe the whole scene. If one uses only the left half of its images, it observes half of it.
TEST(ViewOverlap, IsLimitedToUsedParts) {
  const Camera camera = stereo_rig().camera(0u);
  const UsedView all = UsedView::all_of(camera);
  UsedView left(camera);
  for (std::size_t row = 0; row < UsedView::kRows; ++row) {
    for (std::size_t column = 0; column + 1 < UsedView::kColumns / 2; ++column) left.add(left.centre(column, row));
  }
  ASSERT_EQ(left.size(), kCells / 2);
  const auto share = [&](const UsedView& of, const UsedView& in) {
    return overlap_share(SampledView(camera, of), SampledView(camera, in), geometry::SE3());
  };
  EXPECT_DOUBLE_EQ(share(all, all), 1.0);
  EXPECT_DOUBLE_EQ(share(all, left), 0.5);
  EXPECT_DOUBLE_EQ(share(left, all), 1.0);
  EXPECT_EQ(share(UsedView(camera), all), 0.0);
}

}  // namespace
}  // namespace bslam::camera
