#include "map/cow_vector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "base/random.h"

namespace bslam::map {
namespace {

// A value composed like BundledMap.
struct Value {
  CowOwner owner;
  CowVector<int, 4> vector;
  CowArray<int> array;

  void push_back(int x) {
    vector.push_back(x, owner.tag());
    array.mutate(owner.tag()).push_back(x);
  }
  void set(std::size_t i, int x) {
    vector.mutate(i, owner.tag()) = x;
    array.mutate(owner.tag())[i] = x;
  }
  void blank_chunk(std::size_t chunk) {
    vector.blank_chunk(chunk, owner.tag());
    for (std::size_t i = 4 * chunk; i < 4 * chunk + 4; ++i) array.mutate(owner.tag())[i] = 0;
  }
};

void expect_equal(const Value& value, const std::vector<int>& truth) {
  ASSERT_EQ(value.vector.size(), truth.size());
  EXPECT_EQ(value.array.values(), truth);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_EQ(value.vector[i], truth[i]);
}

TEST(CowVector, CopiesBehaveAsIndependentValues) {
  Random random(1);
  std::vector<Value> values(1);
  std::vector<std::vector<int>> truth(1);
  for (int step = 0; step < 20000; ++step) {
    const std::size_t at = random.below(static_cast<std::uint32_t>(values.size()));
    const int x = static_cast<int>(random.below(1000));
    const std::uint32_t choice = random.below(100);
    if (choice < 3 && values.size() < 8) {
      values.emplace_back(values[at]);
      truth.emplace_back(truth[at]);
    } else if (choice < 5) {
      const std::size_t other = random.below(static_cast<std::uint32_t>(values.size()));
      values[at] = Value(values[other]);
      truth[at] = std::vector<int>(truth[other]);
    } else if (choice < 7) {
      const std::size_t other = random.below(static_cast<std::uint32_t>(values.size()));
      values[at] = values[other];
      truth[at] = truth[other];
    } else if (choice < 40 && truth[at].size() < 700) {
      values[at].push_back(x);
      truth[at].push_back(x);
    } else if (choice < 45 && truth[at].size() >= 4) {
      const std::size_t chunk = random.below(static_cast<std::uint32_t>(truth[at].size() / 4));
      values[at].blank_chunk(chunk);
      std::fill_n(truth[at].begin() + static_cast<std::ptrdiff_t>(4 * chunk), 4, 0);
    } else if (!truth[at].empty()) {
      const std::size_t i = random.below(static_cast<std::uint32_t>(truth[at].size()));
      values[at].set(i, x);
      truth[at][i] = x;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) expect_equal(values[i], truth[i]);
}

TEST(CowVector, ChangesDetachedChunksInPlace) {
  Value value;
  for (int i = 0; i < 100; ++i) value.push_back(i);
  const Value copy = value;
  const int* shared = &copy.vector[50];
  EXPECT_EQ(&value.vector[50], shared);
  value.set(50, -1);
  const int* own = &value.vector[50];
  EXPECT_NE(own, shared);
  EXPECT_EQ(&value.vector[0], &copy.vector[0]);  // in another chunk, hence still shared
  value.set(51, -1);
  EXPECT_EQ(&value.vector[50], own);
}

TEST(CowArray, ReadsLikeAVector) {
  const CowArray<int> none;
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.begin(), none.end());
  const CowArray<int> some({3, 1, 2}, 1);
  const std::span<const int> span = some;
  const std::vector<int>& vector = some;
  EXPECT_EQ(span.data(), vector.data());
  EXPECT_EQ(some[2], 2);
}

}  // namespace
}  // namespace bslam::map
