#include "session/covariance_file.h"

#include <gtest/gtest.h>

#include <sstream>

namespace bslam::session {
namespace {

TEST(CovarianceFile, HasALineForEachPoseOfTracking) {
  RunRecord record;
  for (int i = 0; i < 4; ++i) {
    RunFrame frame{0.1 * i, tracking::FrameRecord()};
    frame.record->result.time_ns = 1'000'000'000 + i;
    if (i != 1) {
      geometry::Matrix6d covariance;
      for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 6; ++column)
          covariance(row, column) = 10 * std::min(row, column) + std::max(row, column);
      frame.record->result.covariance = (i + 1) * covariance;
    }
    record.frames.push_back(frame);
  }
  record.frames.push_back({0.4, std::nullopt});  // a dropped frame
  constexpr TimeNs kSubtracted = 1'000;
  std::istringstream in(covariance_text(record, kSubtracted));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line[0], '#');
  for (const int i : {0, 2, 3}) {
    ASSERT_TRUE(std::getline(in, line));
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    EXPECT_EQ(field, std::to_string(1'000'000'000 + i - kSubtracted));
    for (int row = 0; row < 6; ++row)
      for (int column = row; column < 6; ++column) {
        ASSERT_TRUE(std::getline(fields, field, ','));
        EXPECT_DOUBLE_EQ(std::stod(field), (i + 1) * (10 * row + column));
      }
    EXPECT_FALSE(std::getline(fields, field));
  }
  EXPECT_FALSE(std::getline(in, line));
}

}  // namespace
}  // namespace bslam::session
