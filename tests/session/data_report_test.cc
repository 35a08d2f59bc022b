#include "session/data_report.h"

#include <gtest/gtest.h>

#include "support/data_on_disk.h"

namespace bslam::session {
namespace {

TEST(DataReport, TheFirstTimeHasEveryNanosecond) {
  const support::TemporaryFolder folder;
  for (const char* name : {"1000000000000000119", "1000000000050000119", "1000000000100000119"})
    support::write_image(folder.path() / "cam0" / (std::string(name) + ".png"), 32, 24);
  const auto report = report_data({.path = folder.path()}, false);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NE(report->text.find(": folder, 0.100 s from 1000000000.000000119 s\n"), std::string::npos) << report->text;
}

}  // namespace
}  // namespace bslam::session
