#include "base/shared_array.h"

#include <gtest/gtest.h>

#include <string>

namespace bslam {
namespace {

TEST(SharedArray, CopiesShareTheElements) {
  const SharedArray<std::string> a = std::vector<std::string>{"one", "two", "three"};
  const SharedArray<std::string> b = a;
  EXPECT_EQ(a.data(), b.data());
  EXPECT_EQ(b.size(), 3u);
  EXPECT_EQ(b[1], "two");
  EXPECT_EQ(b.front(), "one");
  EXPECT_EQ(b.back(), "three");
}

TEST(SharedArray, CopyOutlivesTheOriginal) {
  SharedArray<std::string> a = std::vector<std::string>{"one"};
  const SharedArray<std::string> b = a;
  a = std::vector<std::string>{"two"};
  EXPECT_EQ(b[0], "one");
  EXPECT_EQ(a[0], "two");
}

TEST(SharedArray, ComparesElements) {
  const SharedArray<int> a = std::vector<int>{1, 2}, same = std::vector<int>{1, 2}, other = std::vector<int>{1, 2, 3};
  EXPECT_TRUE(a == same);
  EXPECT_FALSE(a == other);
  EXPECT_TRUE(SharedArray<int>() == SharedArray<int>(std::vector<int>()));
}

TEST(SharedArray, CopyCanBeChanged) {
  const SharedArray<int> a = std::vector<int>{1, 2};
  std::vector<int> copy = a.copy();
  copy[0] = 7;
  EXPECT_EQ(a[0], 1);
  EXPECT_TRUE(SharedArray<int>().empty());
}

}  // namespace
}  // namespace bslam
