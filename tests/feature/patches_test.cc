#include "feature/patches.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace bslam::feature {
namespace {

std::vector<Patch> random_patches(std::size_t count) {
  Random random(1, "patches");
  std::vector<Patch> out(count);
  for (Patch& patch : out) {
    for (std::uint8_t& value : patch) value = static_cast<std::uint8_t>(random.below(256));
  }
  return out;
}

TEST(Patches, AreCompleteWhenMadeOfAVector) {
  const std::vector<Patch> all = random_patches(70);
  const Patches patches(std::vector<Patch>{all});
  EXPECT_TRUE(patches.complete());
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(*patches.find(k), all[k]);
  EXPECT_TRUE(Patches().complete());
}

TEST(Patches, KeepThoseThatAreWanted) {
  const std::vector<Patch> all = random_patches(200);
  Random random(2, "wanted");
  std::vector<std::uint8_t> wanted(all.size());
  for (std::uint8_t& flag : wanted) flag = random.below(4) == 0;
  const Patches some = Patches(std::vector<Patch>{all}).only(wanted);
  EXPECT_EQ(some.size(), all.size());
  EXPECT_FALSE(some.complete());
  for (std::size_t k = 0; k < all.size(); ++k) {
    ASSERT_EQ(some.find(k) != nullptr, wanted[k] != 0) << k;
    if (wanted[k] != 0) {
      EXPECT_EQ(some[k], all[k]);
    }
  }
  const Patches again(some.patches(), some.present(), some.size());
  EXPECT_EQ(again, some);
  EXPECT_NE(some, Patches(std::vector<Patch>{all}));
}

TEST(Patches, ShareThePatchesIfAllAreWanted) {
  const Patches all(random_patches(100));
  const std::vector<std::uint8_t> every(100, 1);
  EXPECT_EQ(all.only(every).patches().data(), all.patches().data());
  std::vector<std::uint8_t> even(100, 0);
  for (std::size_t k = 0; k < even.size(); k += 2) even[k] = 1;
  const Patches half = all.only(even);
  EXPECT_EQ(half.only(every).patches().data(), half.patches().data());  // none of the absent ones comes back
}

TEST(Patches, NeedLessMemoryIfFewAreKept) {
  const Patches all(random_patches(1000));
  std::vector<std::uint8_t> wanted(1000, 0);
  for (std::size_t k = 0; k < wanted.size(); k += 10) wanted[k] = 1;
  MemoryCount count;
  EXPECT_LT(5 * all.only(wanted).memory_bytes(count), all.memory_bytes(count));
}

}  // namespace
}  // namespace bslam::feature
