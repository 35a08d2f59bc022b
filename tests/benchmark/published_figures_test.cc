#include "benchmark/published_figures.h"

#include <gtest/gtest.h>

namespace bslam::benchmark {
namespace {

TEST(PublishedFigures, AreFoundByTheUsualNamesOfCompleteSequences) {
  for (const char* name : {"MH_04_difficult", "MH04", "mh_04"}) {
    const auto figures = published_figures(name);
    ASSERT_EQ(figures.size(), 11u) << name;
    EXPECT_EQ(figures.front().ate_m, 0.032) << name;
  }
  EXPECT_EQ(published_figures("06").size(), 1u);
}

TEST(PublishedFigures, AreNotGivenForExtractsAndOtherSequences) {
  for (const char* name : {"euroc_mh01_start", "MH_01_easy_short", "11", "room1", ""}) {
    EXPECT_TRUE(published_figures(name).empty()) << name;
  }
}

TEST(PublishedFigures, OmitSystemsWithoutAResult) {
  for (const PublishedFigure& figure : published_figures("V2_03_difficult")) {
    EXPECT_NE(figure.row->system, "ORB-SLAM2 stereo");
    EXPECT_NE(figure.row->system, "VINS-Fusion stereo");
  }
}

}  // namespace
}  // namespace bslam::benchmark
