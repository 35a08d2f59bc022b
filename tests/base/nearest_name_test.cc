#include "base/nearest_name.h"

#include <gtest/gtest.h>

#include <vector>

namespace bslam {
namespace {

TEST(EditDistance, CountsInsertionsDeletionsAndReplacements) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("abc", ""), 3u);
  EXPECT_EQ(edit_distance("same", "same"), 0u);
}

TEST(NearestName, FindsTheIntendedName) {
  const std::vector<std::string> known = {"features.per_image", "features.levels", "pose.rounds"};
  EXPECT_EQ(nearest_name("features.per_imge", known), "features.per_image");
  EXPECT_EQ(nearest_name("level", known), "features.levels");
  EXPECT_EQ(nearest_name("pose.round", known), "pose.rounds");
  EXPECT_EQ(nearest_name("anything", {}), "");
}

TEST(NearestName, ReturnsNothingIfNoNameIsClose) {
  const std::vector<std::string> known = {"bundling.near_m", "features.per_image", "seed"};
  EXPECT_EQ(nearest_name("nfeatures", known), "");
  EXPECT_EQ(nearest_name("frobnicate", known), "");
  EXPECT_EQ(nearest_name("sed", known), "seed");
}

}  // namespace
}  // namespace bslam
