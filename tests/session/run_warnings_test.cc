#include "session/run_warnings.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

bool has_text(const std::vector<std::string>& warnings, const std::string& text) {
  return std::ranges::any_of(warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

// A run moves a focal length towards the right one, but from far away it may end elsewhere.
TEST(RunWarnings, AFocalLengthThatIsFarOffIsSaid) {
  const camera::Rig rig = synthetic::default_rig();
  const double fx = camera::intrinsics(rig.camera(0).model).fx;
  for (const double change : {0.03, 0.07}) {
    RunRecord record;
    record.complete = true;
    record.cameras.resize(rig.size());
    record.calibration.estimate.verdict = calibration::Verdict::kInconsistent;
    record.calibration.estimate.cameras.resize(rig.size());
    record.calibration.estimate.cameras[0].intrinsics = {{.name = "fx", .change = -change * fx, .std = 0.5}};
    const std::vector<std::string> warnings = warnings_after_run(record, rig, "");
    EXPECT_TRUE(has_text(warnings, "estimated intrinsics differ"));
    EXPECT_EQ(has_text(warnings, "the focal length seems to be wrong by 7 %"), change > 0.05);
  }
}

}  // namespace
}  // namespace bslam::session
