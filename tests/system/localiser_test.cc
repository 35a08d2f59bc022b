#include "system/localiser.h"

#include <gtest/gtest.h>

namespace bslam::system {
namespace {

bool contradicts(int matched, int inliers) {
  return contradicts_pose({.keypoints = 1000, .matched = matched, .inliers = inliers});
}

// Of images that are those of their cameras, more than 60 % of the matches are inliers.
TEST(Localiser, ManyMatchesThatAreNoInliersContradictThePose) {
  EXPECT_FALSE(contradicts(500, 310));
  EXPECT_FALSE(contradicts(500, 230));
  EXPECT_TRUE(contradicts(500, 210));
  EXPECT_FALSE(contradicts(30, 8));
  EXPECT_TRUE(contradicts(30, 7));
  EXPECT_FALSE(contradicts(29, 0));
}

}  // namespace
}  // namespace bslam::system
