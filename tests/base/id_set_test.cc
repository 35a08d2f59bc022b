#include "base/id_set.h"

#include <gtest/gtest.h>

#include "base/id.h"

namespace bslam {
namespace {

TEST(IdSet, ContainsWhatWasInserted) {
  const std::vector<LandmarkId> range = {LandmarkId(7), LandmarkId(3), LandmarkId(5)};
  IdSet<LandmarkId> set(range);
  EXPECT_TRUE(set.insert(LandmarkId(3)));
  EXPECT_TRUE(set.insert(LandmarkId(7)));
  EXPECT_FALSE(set.insert(LandmarkId(3)));
  for (const int id : {3, 7}) EXPECT_TRUE(set.contains(LandmarkId(id))) << id;
  for (const int id : {0, 2, 4, 5, 6, 8, 1000}) EXPECT_FALSE(set.contains(LandmarkId(id))) << id;
}

TEST(IdSet, MayBeEmpty) { EXPECT_FALSE(IdSet<LandmarkId>(std::span<const LandmarkId>()).contains(LandmarkId(0))); }

}  // namespace
}  // namespace bslam
