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

TEST(RunWarnings, ACameraThatIsOneFrameLateIsNamedFirst) {
  RunRecord record;
  record.cameras.resize(2);
  record.cameras[0].name = "left";
  record.cameras[1].name = "right";
  record.calibration.late = calibration::LateCamera{1, 0, false, 90, 20, 100, 95};
  const std::vector<std::string> warnings = warnings_after_run(record, synthetic::default_rig(), "");
  EXPECT_EQ(warnings[0].find("right: its images are about one frame late compared with left: 95 of 100 matches"), 0u)
      << warnings[0];
}

// A map of a calibration that was contradicted and kept is stored with the reason.
TEST(RunWarnings, AMapOfAContradictedCalibrationIsUnreliable) {
  RunRecord record;
  record.complete = true;
  EXPECT_EQ(unreliable_map_text(record), "");
  record.calibration.estimate.verdict = calibration::Verdict::kInconsistent;
  record.calibration.estimate.excess_error = 2;
  EXPECT_EQ(unreliable_map_text(record),
            "the images contradict the calibration, which multiplies their squared reprojection error by 3.0");
  record.calibration.refined = true;
  EXPECT_EQ(unreliable_map_text(record), "");
}

}  // namespace
}  // namespace bslam::session
