#include "session/run_warnings.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "camera/model_parameters.h"
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

// Undistorted images with the calibration of the distorted ones.
TEST(RunWarnings, ADistortionThatIsFarOffIsSaid) {
  const camera::Rig rig = synthetic::ring_rig(2);
  const camera::ModelParameters given = camera::parameters(rig.camera(0).model);
  ASSERT_LT(given(4), -0.1);  // k1
  for (const bool undistorted : {false, true}) {
    RunRecord record;
    record.complete = true;
    record.cameras.resize(rig.size());
    record.calibration.estimate.verdict = calibration::Verdict::kInconsistent;
    record.calibration.estimate.cameras.resize(rig.size());
    for (const std::string& name : camera::parameter_names(rig.camera(0).model))
      record.calibration.estimate.cameras[0].intrinsics.push_back({.name = name, .std = 0.001});
    record.calibration.estimate.cameras[0].intrinsics[4].change = undistorted ? -given(4) : 0.02;
    const std::vector<std::string> warnings = warnings_after_run(record, rig, "");
    EXPECT_EQ(has_text(warnings, "the estimated distortion differs"), undistorted);
  }
}

TEST(RunWarnings, AMovedCameraIsNamedWithWhatBecameOfTheMove) {
  const camera::Rig rig = synthetic::ring_rig(2);
  for (const auto& [in_map, refined, end] : {std::tuple(false, false, "; the map does not take this into account"),
                                             std::tuple(true, false, "; the map takes this into account"),
                                             std::tuple(true, true, ", and rig_refined.yaml is the rig after it")}) {
    RunRecord record;
    record.complete = true;
    record.cameras.resize(2);
    record.cameras[0].name = "left";
    record.cameras[1].name = "right";
    record.calibration.moves_in_map = in_map;
    record.calibration.refined = refined;
    record.calibration.moves = {{1, 4.04, 0.31, 0.01, 2.5, 0.6}};
    const std::vector<std::string> warnings = warnings_after_run(record, rig, "");
    ASSERT_FALSE(warnings.empty());
    EXPECT_TRUE(warnings[0].starts_with(
        "right: moved relative to left at about 4.0 s, by 0.31 deg (std 0.01) and 2.5 mm (std 0.6); the map "))
        << warnings[0];
    EXPECT_TRUE(warnings[0].ends_with(end)) << warnings[0];
  }
}

// What looks like moves of a camera whose images are late is not said, nor what its extrinsics seem to be.
TEST(RunWarnings, ACameraWhoseTimeStampsChangedIsNamedInsteadOfItsMoves) {
  RunRecord record;
  record.complete = true;
  record.cameras.resize(2);
  record.cameras[0].name = "left";
  record.cameras[1].name = "right";
  record.cameras[1].extrinsics = ExtrinsicsRecord{.change_deg = 0.7, .change_mm = 12, .suspect = true};
  record.calibration.estimate.verdict = calibration::Verdict::kConsistent;
  record.calibration.estimate.done = record.calibration.estimate.implausible = true;
  record.calibration.estimate.jump = calibration::TimeJump{.camera = 1, .shift_s = -0.007};
  record.calibration.jump_at_s = 6.04;
  record.calibration.accept_estimate(true, true);
  EXPECT_FALSE(record.calibration.applies);
  EXPECT_EQ(record.calibration.verdict(), calibration::Verdict::kUnknown);
  const camera::Rig rig = synthetic::ring_rig(2);
  std::vector<std::string> warnings = warnings_after_run(record, rig, "");
  EXPECT_TRUE(has_text(warnings, "right: from about 6.0 s on, its images seem to have been taken earlier"));
  EXPECT_FALSE(has_text(warnings, "estimated extrinsics"));
  // The test of images says it more exactly.
  record.calibration.late = calibration::LateCamera{1, 0, false, 90, 20, 100, 95, "last half"};
  record.calibration.moves = {{1, 6.75, 0.70, 0.03, 83.3, 4.2}};
  warnings = warnings_after_run(record, rig, "");
  EXPECT_TRUE(has_text(warnings, "right: its images are about one frame late"));
  EXPECT_FALSE(has_text(warnings, "from about"));
  EXPECT_FALSE(has_text(warnings, "moved relative"));
}

TEST(RunWarnings, ACameraWhoseImagesContradictEachOtherIsNamedInsteadOfItsExtrinsics) {
  RunRecord record;
  record.complete = true;
  record.cameras.resize(2);
  record.cameras[1].name = "right";
  record.cameras[1].extrinsics = ExtrinsicsRecord{.change_deg = 0.7, .change_mm = 12, .suspect = true};
  record.calibration.estimate.done = record.calibration.estimate.implausible = true;
  record.calibration.estimate.unsteady = 1;
  for (const calibration::Verdict verdict : {calibration::Verdict::kConsistent, calibration::Verdict::kInconsistent}) {
    record.calibration.estimate.verdict = verdict;
    record.calibration.accept_estimate(true, false);
    EXPECT_FALSE(record.calibration.applies);
    EXPECT_NE(record.calibration.verdict(), calibration::Verdict::kConsistent);
    const std::vector<std::string> warnings = warnings_after_run(record, synthetic::ring_rig(2), "");
    EXPECT_TRUE(has_text(warnings, "right: its images contradict each other, whatever its calibration"));
    EXPECT_FALSE(has_text(warnings, "estimated extrinsics"));
    EXPECT_EQ(has_text(warnings, "since the images of a camera contradict each other"),
              verdict == calibration::Verdict::kInconsistent);
  }
}

TEST(RunWarnings, ACameraWhoseImagesAreNotExplainedIsNamed) {
  for (const auto& [rms_px, inliers, named] :
       {std::tuple(0.8, 57, true), std::tuple(0.4, 57, false), std::tuple(0.8, 88, false)}) {
    RunRecord record;
    record.complete = true;
    record.cameras.resize(3);
    tracking::FrameRecord frame;
    frame.result.status = tracking::TrackStatus::kTracking;
    frame.result.cameras.resize(3);
    for (std::size_t c = 0; c < 3; ++c) {
      record.cameras[c].name = "c" + std::to_string(c);
      record.cameras[c].residuals = {.observations = 1000, .rms_px = c == 1 ? rms_px : 0.25, .cells = {}};
      frame.result.cameras[c].matched = 100;
      frame.result.cameras[c].inliers = c == 1 ? inliers : 90;
    }
    record.frames = {{0.0, frame}};
    EXPECT_EQ(unexplained_cameras(record), named ? std::vector<std::size_t>{1} : std::vector<std::size_t>{});
    record.calibration.unexplained = unexplained_cameras(record);
    record.calibration.estimate.verdict = calibration::Verdict::kConsistent;
    record.calibration.estimate.done = true;
    record.calibration.accept_estimate(true, true);
    EXPECT_EQ(record.calibration.verdict(), named ? calibration::Verdict::kUnknown : calibration::Verdict::kConsistent);
    EXPECT_EQ(record.calibration.refined, !named);
    EXPECT_EQ(has_text(warnings_after_run(record, synthetic::ring_rig(3), ""),
                       "c1: its reprojection error of 0.80 px is more than twice that of the other cameras"),
              named);
  }
}

TEST(RunWarnings, ErrorsOfTimeStampsThatWereCorrectedAreSaid) {
  const camera::Rig rig = synthetic::ring_rig(2);
  RunRecord record;
  record.cameras.resize(2);
  record.cameras[1].name = "left";
  EXPECT_FALSE(has_text(warnings_after_run(record, rig, ""), "time stamps have errors"));
  record.cameras[1].stamp_error_s = 0.0023;
  EXPECT_TRUE(has_text(warnings_after_run(record, rig, ""), "left: its time stamps have errors of about 2.3 ms"));
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

// Some images of a run that has hardly any pose were tested.
TEST(RunWarnings, AMirroredCameraIsNamedIfMostFramesAreLost) {
  RunRecord record;
  record.complete = true;
  record.maps_started = 1;
  record.cameras.resize(2);
  record.cameras[0].name = "left";
  record.cameras[1].name = "right";
  calibration::PairEvidence evidence{.first = 0, .second = 1, .matches = 500};
  evidence.mirrored = calibration::MirroredCamera{1, 480, 450};
  record.calibration.pairs = {{.first = 0, .second = 1, .overlap = 0.8, .evidence = evidence, .contradicted = true}};
  const std::vector<std::string> warnings = warnings_after_run(record, synthetic::default_rig(), "");
  EXPECT_TRUE(has_text(warnings, "so poses, scale and map are wrong: of cameras left and right 450 of 480 matches"));
  EXPECT_TRUE(has_text(warnings, "Turn off the mirroring"));
}

// The estimate is made with images of different times.
TEST(RunWarnings, WithALateCameraNoEstimateIsOffered) {
  RunRecord record;
  record.cameras.resize(2);
  record.cameras[1].name = "right";
  record.calibration.estimate.done = true;
  record.calibration.estimate.verdict = calibration::Verdict::kConsistent;
  record.calibration.accept_estimate(true, true);
  EXPECT_TRUE(record.calibration.refined);
  EXPECT_EQ(record.calibration.verdict(), calibration::Verdict::kConsistent);
  record.calibration.late = calibration::LateCamera{.camera = 1, .part = "last half"};
  record.calibration.accept_estimate(true, true);
  EXPECT_FALSE(record.calibration.applies || record.calibration.refined);
  EXPECT_EQ(record.calibration.verdict(), calibration::Verdict::kUnknown);
  EXPECT_NE(unreliable_map_text(record).find("right: its images are about one frame late"), std::string::npos);
  record.calibration.estimate.verdict = calibration::Verdict::kInconsistent;
  const std::vector<std::string> warnings = warnings_after_run(record, synthetic::default_rig(), "");
  EXPECT_TRUE(has_text(warnings, "in the last half of the recording"));
  EXPECT_TRUE(has_text(warnings, "no rig_refined.yaml is written"));
  EXPECT_TRUE(has_text(warnings, "the estimate is not written to rig_refined.yaml"));
  EXPECT_FALSE(has_text(warnings, "calibration.refine=true"));
}

TEST(RunWarnings, AnImplausibleEstimateIsNotOffered) {
  RunRecord record;
  record.cameras.resize(2);
  record.calibration.estimate.done = true;
  record.calibration.estimate.verdict = calibration::Verdict::kInconsistent;
  record.calibration.accept_estimate(true, true);
  EXPECT_TRUE(record.calibration.applies && record.calibration.refined);
  record.calibration.estimate.implausible = true;
  record.calibration.accept_estimate(true, false);
  EXPECT_FALSE(record.calibration.applies || record.calibration.refined);
  EXPECT_FALSE(calibration::accepted(record.calibration.estimate, {.refine = calibration::Refine::kTrue}));
  const std::vector<std::string> warnings = warnings_after_run(record, synthetic::default_rig(), "");
  EXPECT_TRUE(has_text(warnings, "the estimate cannot be used for other recordings"));
  EXPECT_FALSE(has_text(warnings, "calibration.refine="));
}

TEST(RunWarnings, MirroredImagesAreNamed) {
  RunRecord record;
  record.cameras.resize(2);
  record.cameras[0].name = "left";
  record.cameras[1].name = "right";
  record.calibration.pairs = {{.first = 0,
                               .second = 1,
                               .keyframes = 8,
                               .evidence = calibration::PairEvidence{.matches = 100,
                                                                     .agreeing = {30, 0, 0, 0, 0, 98},
                                                                     .verdict = calibration::Convention::kMirrored},
                               .contradicted = true}};
  EXPECT_TRUE(has_text(warnings_after_run(record, synthetic::default_rig(), "check"),
                       "the images are mirrored left to right, so poses, scale and map are wrong: of cameras left and "
                       "right, 98 of 100 matches are consistent with the calibration if the images of both cameras are "
                       "mirrored left to right; 30 with it as given. Turn off the mirroring of the cameras or of their "
                       "driver (check)"));
}

// Most frames are lost, which has other reasons if the calibration agrees with the images.
TEST(RunWarnings, ACalibrationThatAgreesIsNotBlamed) {
  RunRecord record;
  record.cameras.resize(2);
  record.frames.resize(3);
  for (RunFrame& frame : record.frames) {
    frame.record.emplace();
    frame.record->result.status = tracking::TrackStatus::kLost;
    frame.record->result.reason = tracking::LostReason::kFewMatches;
    frame.record->result.cameras.resize(2);
  }
  const auto warnings = [&] { return warnings_after_run(record, synthetic::default_rig(), "check"); };
  record.maps_started = 1;
  EXPECT_TRUE(has_text(warnings(), "most frames have no pose, maybe because of a wrong calibration"));
  record.calibration.estimate.verdict = calibration::Verdict::kConsistent;
  EXPECT_FALSE(has_text(warnings(), "wrong calibration"));
  EXPECT_TRUE(has_text(warnings(), "fast motion and moving objects are likelier reasons"));
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
