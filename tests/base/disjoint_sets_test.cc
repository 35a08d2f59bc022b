#include "base/disjoint_sets.h"

#include <gtest/gtest.h>

namespace bslam {
namespace {

TEST(DisjointSets, HaveTheirSmallestElementAsRoot) {
  DisjointSets sets(7);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(sets.root(i), i);
  sets.join(5, 6);
  sets.join(3, 5);
  sets.join(1, 2);
  sets.join(6, 3);
  const std::size_t roots[] = {0, 1, 1, 3, 4, 3, 3};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(sets.root(i), roots[i]) << i;
  sets.join(2, 6);
  EXPECT_EQ(sets.root(5), 1u);
}

}  // namespace
}  // namespace bslam
