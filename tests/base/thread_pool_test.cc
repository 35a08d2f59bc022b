#include "base/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace bslam {
namespace {

class ThreadPoolOf : public testing::TestWithParam<int> {};

TEST_P(ThreadPoolOf, RunsEachItemOnce) {
  ThreadPool pool(GetParam());
  EXPECT_EQ(pool.size(), GetParam());
  for (const std::size_t count : {0u, 1u, 2u, 3u, 100u, 5000u}) {
    std::vector<std::atomic<int>> done(count);
    pool.for_each(count, [&](std::size_t i) { ++done[i]; });
    for (const auto& times : done) ASSERT_EQ(times, 1);
  }
}

TEST_P(ThreadPoolOf, RunsManyShortLoops) {
  ThreadPool pool(GetParam());
  std::vector<int> sums(8, 0);
  for (int loop = 0; loop < 2000; ++loop)
    pool.for_each(sums.size(), [&](std::size_t i) { sums[i] += static_cast<int>(i); });
  for (std::size_t i = 0; i < sums.size(); ++i) EXPECT_EQ(sums[i], 2000 * static_cast<int>(i));
}

TEST_P(ThreadPoolOf, RethrowsAndRemainsUsable) {
  ThreadPool pool(GetParam());
  for (int round = 0; round < 20; ++round) {
    EXPECT_THROW(pool.for_each(50,
                               [](std::size_t i) {
                                 if (i == 20) throw std::runtime_error("item 20");
                               }),
                 std::runtime_error);
    std::atomic<int> done = 0;
    pool.for_each(50, [&](std::size_t) { ++done; });
    EXPECT_EQ(done, 50);
  }
}

TEST_P(ThreadPoolOf, RunsAllOtherItemsIfOneThrows) {
  ThreadPool pool(GetParam());
  std::vector<std::atomic<int>> done(40);
  EXPECT_THROW(pool.for_each(done.size(),
                             [&](std::size_t i) {
                               ++done[i];
                               if (i == 3) throw std::runtime_error("item 3");
                             }),
               std::runtime_error);
  for (const auto& times : done) EXPECT_EQ(times, 1);
}

INSTANTIATE_TEST_SUITE_P(Threads, ThreadPoolOf, testing::Values(1, 2, 5));

}  // namespace
}  // namespace bslam
