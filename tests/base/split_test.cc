#include "base/split.h"

#include <gtest/gtest.h>

namespace bslam {
namespace {

TEST(Split, KeepsEmptyParts) {
  using Parts = std::vector<std::string>;
  EXPECT_EQ(split("a,bc", ','), (Parts{"a", "bc"}));
  EXPECT_EQ(split("a", ','), Parts{"a"});
  EXPECT_EQ(split("", ','), Parts{""});
  EXPECT_EQ(split(",a,,b,", ','), (Parts{"", "a", "", "b", ""}));
}

}  // namespace
}  // namespace bslam
