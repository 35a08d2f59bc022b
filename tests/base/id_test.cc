#include "base/id.h"

#include <gtest/gtest.h>

#include <concepts>
#include <type_traits>
#include <unordered_set>

namespace bslam {
namespace {

template <class A, class B>
concept Comparable = requires(A a, B b) {
  a == b;
};

// Ids of different types do not convert to each other or to integers.
static_assert(!std::is_convertible_v<KeyframeId, LandmarkId>);
static_assert(!std::is_constructible_v<KeyframeId, LandmarkId>);
static_assert(!std::is_assignable_v<KeyframeId&, FrameId>);
static_assert(!std::is_convertible_v<int, KeyframeId>);
static_assert(!std::is_convertible_v<KeyframeId, int>);
static_assert(!Comparable<KeyframeId, LandmarkId>);
static_assert(Comparable<KeyframeId, KeyframeId>);

TEST(Id, IsInvalidByDefault) {
  EXPECT_FALSE(KeyframeId().valid());
  EXPECT_TRUE(KeyframeId(0).valid());
  EXPECT_EQ(KeyframeId().next(), KeyframeId(0));
}

TEST(Id, IsOrderedByValue) {
  EXPECT_LT(FrameId(1), FrameId(2));
  EXPECT_EQ(FrameId(std::size_t{7}).index(), 7u);
  EXPECT_EQ(FrameId(7).next(), FrameId(8));
}

TEST(Id, Hashes) {
  const std::unordered_set<LandmarkId> ids = {LandmarkId(1), LandmarkId(2), LandmarkId(1)};
  EXPECT_EQ(ids.size(), 2u);
}

}  // namespace
}  // namespace bslam
