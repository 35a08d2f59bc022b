#include "map_service/bounded_queue.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace bslam::map_service {
namespace {

TEST(BoundedQueue, RefusesWhatItHasNoRoomFor) {
  BoundedQueue<std::unique_ptr<int>> queue(2);
  EXPECT_TRUE(queue.push(std::make_unique<int>(1)));
  EXPECT_TRUE(queue.push(std::make_unique<int>(2)));
  EXPECT_TRUE(queue.is_full());
  auto third = std::make_unique<int>(3);
  EXPECT_FALSE(queue.push(std::move(third)));
  EXPECT_NE(third, nullptr);  // whose request can still be answered
  EXPECT_EQ(**queue.pop(), 1);
  EXPECT_FALSE(queue.is_full());
}

TEST(BoundedQueue, AClosedQueueIsEmptied) {
  BoundedQueue<int> queue(2);
  queue.push(1);
  queue.close();
  EXPECT_FALSE(queue.push(2));
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, EveryElementReachesOneThread) {
  constexpr int kThreads = 4, kElements = 1000;
  BoundedQueue<int> queue(3);
  std::vector<int> taken(kElements, 0);
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&] {
        while (const auto element = queue.pop()) ++taken[static_cast<std::size_t>(*element)];
      });
    }
    for (int i = 0; i < kElements;) i += queue.push(int(i)) ? 1 : 0;
    queue.close();
  }
  EXPECT_EQ(taken, std::vector<int>(kElements, 1));
}

}  // namespace
}  // namespace bslam::map_service
