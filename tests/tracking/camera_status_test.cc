#include "tracking/camera_status.h"

#include <gtest/gtest.h>

#include "synthetic/rigs.h"
#include "tracking/camera_evidence.h"

namespace bslam::tracking {
namespace {

using image::ImageState;

constexpr CameraStatus kGood{};

constexpr CameraStatus out(CameraReason reason) { return {CameraState::kOut, reason}; }
constexpr CameraStatus degraded(CameraReason reason) { return {CameraState::kDegraded, reason}; }

CameraEvidence good() { return {.image = ImageState::kPresent, .extracted = 500, .keypoints = 500, .inliers = 200}; }
CameraEvidence no_image(ImageState why = ImageState::kMissing) {
  return {.image = why, .outage = CameraReason::kNoImages, .extracted = 0};
}

// Status of the only camera of a rig.
CameraStatus alone(const CameraEvidence& evidence) { return CameraStatusMonitor(1).update(std::vector{evidence})[0]; }

TEST(CameraStatus, ReportsTheFaultOfTheImage) {
  EXPECT_EQ(alone(good()), kGood);
  for (const CameraReason reason : {CameraReason::kBlack, CameraReason::kOverExposed, CameraReason::kFrozen}) {
    CameraEvidence evidence = good();
    evidence.outage = reason;
    evidence.inconsistent = true;  // the fault of the image has priority
    EXPECT_EQ(alone(evidence), out(reason)) << describe(reason);
  }
}

TEST(CameraStatus, ABlurredCameraIsDegradedWhileItIsConsistent) {
  CameraEvidence evidence = good();
  evidence.blurred = true;
  EXPECT_EQ(alone(evidence), degraded(CameraReason::kBlurred));
  evidence.inconsistent = true;
  EXPECT_EQ(alone(evidence), out(CameraReason::kBlurred));
  evidence.blurred = false;
  EXPECT_EQ(alone(evidence), out(CameraReason::kInconsistent));
}

TEST(CameraStatus, FewFeaturesDegradeACameraThatIsUsed) {
  CameraEvidence evidence = good();
  evidence.extracted = evidence.keypoints = evidence.inliers = 29;
  EXPECT_EQ(alone(evidence), degraded(CameraReason::kFewFeatures));
  evidence.keypoints = 0;
  evidence.postponed = true;  // its image was not used
  EXPECT_EQ(alone(evidence), kGood);
}

TEST(CameraStatus, KeepsFewFeaturesWhileFeaturesAreNotExtracted) {
  CameraStatusMonitor monitor(1);
  const auto update = [&](int keypoints, std::optional<int> extracted) {
    CameraEvidence evidence = good();
    evidence.keypoints = keypoints;
    evidence.extracted = extracted;
    return monitor.update(std::vector{evidence})[0];
  };
  EXPECT_EQ(update(500, 500), kGood);
  EXPECT_EQ(update(5, {}), kGood);
  EXPECT_EQ(update(5, 5), degraded(CameraReason::kFewFeatures));
  EXPECT_EQ(update(500, {}), degraded(CameraReason::kFewFeatures));
  EXPECT_EQ(update(5, {}), degraded(CameraReason::kFewFeatures));
  EXPECT_EQ(update(20, 500), kGood);  // a keyframe was created of an earlier frame
}

// Statuses of a camera that has an image in the frames marked x; O: out.
std::string statuses(const std::string& images) {
  CameraStatusMonitor monitor(1);
  std::string text;
  for (const char c : images) {
    const CameraStatus status = monitor.update(std::vector{c == 'x' ? good() : no_image()})[0];
    EXPECT_TRUE(status == kGood || status == out(CameraReason::kNoImages));
    text += status == kGood ? '.' : 'O';
  }
  return text;
}

TEST(CameraStatus, ACameraOfFullRateIsOutWithoutAnImage) { EXPECT_EQ(statuses("xxx-xx--x"), "...O..OO."); }

TEST(CameraStatus, ASlowCameraIsNotOutBetweenItsImages) {
  EXPECT_EQ(statuses("x--x--x--x--x"), ".............");
  EXPECT_EQ(statuses("--x--x--x"), ".........");
  EXPECT_EQ(statuses("x--x--x-----x--x"), ".........OOO....");  // one image is missing
  EXPECT_EQ(statuses("x--x--x-------"), ".........OOOOO");
}

TEST(CameraStatus, ACameraOfUnknownPeriodIsOutAfterSomeFrames) {
  EXPECT_EQ(statuses("-------------"), "..........OOO");
  EXPECT_EQ(statuses("x------------"), "...........OO");
}

TEST(CameraStatus, ADamagedImageMeansTheCameraIsOut) {
  CameraStatusMonitor monitor(1);
  for (const bool image : {true, false, true, false}) monitor.update(std::vector{image ? good() : no_image()});
  EXPECT_EQ(monitor.update(std::vector{no_image(ImageState::kDamaged)})[0], out(CameraReason::kNoImages));
}

// Status of the second of two cameras after `frames` frames with these numbers of inliers.
CameraStatus after(int frames, int inliers, int inliers_of_other) {
  CameraStatusMonitor monitor(2);
  CameraEvidence first = good(), second = good();
  first.inliers = inliers_of_other;
  second.inliers = inliers;
  CameraStatus status;
  for (int i = 0; i < frames; ++i) status = monitor.update(std::vector{first, second})[1];
  return status;
}

TEST(CameraStatus, ACameraWithHardlyAnyInliersIsInconsistent) {
  EXPECT_EQ(after(12, 5, 200), degraded(CameraReason::kInconsistent));
  EXPECT_EQ(after(12, 15, 200), kGood);  // low inlier ratio, but not inconsistent
  EXPECT_EQ(after(12, 5, 40), kGood);    // no other camera has a high inlier ratio
  EXPECT_EQ(after(5, 5, 200), kGood);    // too few frames
  EXPECT_EQ(after(12, 0, 0), kGood);     // lost
}

// A camera that overlaps no other one has no landmarks in view before the rig has moved.
TEST(CameraStatus, ACameraIsNotInconsistentBeforeTheMapCanHaveLandmarksInItsView) {
  for (const bool overlaps : {false, true}) {
    for (const std::size_t keyframes : {1u, 2u}) {
      const std::vector<std::uint8_t> overlapping = {1, overlaps};
      CameraStatusMonitor monitor(2);
      CameraStatus status;
      for (int i = 0; i < 40; ++i) {
        std::vector<CameraEvidence> evidence = {good(), good()};
        evidence[1].inliers = 0;
        leave_out_inliers_of_new_map(keyframes, overlapping, evidence);
        status = monitor.update(evidence)[1];
      }
      EXPECT_EQ(status, !overlaps && keyframes < 2 ? kGood : degraded(CameraReason::kInconsistent)) << keyframes;
    }
  }
}

TEST(CameraStatus, CamerasOverlapIfTheyShareATenthOfAView) {
  EXPECT_EQ(overlapping_cameras(synthetic::ring_rig(1)), std::vector<std::uint8_t>{0});
  EXPECT_EQ(overlapping_cameras(synthetic::ring_rig(2)), (std::vector<std::uint8_t>{1, 1}));
}

TEST(CameraStatus, ACameraThatWasGoodForAnHourBecomesInconsistentWithinAMinute) {
  CameraStatusMonitor monitor(2);
  CameraEvidence first = good(), second = good();
  first.inliers = second.inliers = 200;
  for (int i = 0; i < 72'000; ++i) monitor.update(std::vector{first, second});
  second.inliers = 0;
  CameraStatus status;
  for (int i = 0; i < 1200; ++i) status = monitor.update(std::vector{first, second})[1];
  EXPECT_EQ(status, degraded(CameraReason::kInconsistent));
  second.inliers = 200;
  for (int i = 0; i < 100; ++i) status = monitor.update(std::vector{first, second})[1];
  EXPECT_EQ(status, kGood);
}

TEST(CameraStatus, NamesMatchTheSummary) {
  EXPECT_EQ(describe(CameraState::kOk), "ok");
  EXPECT_EQ(describe(CameraState::kDegraded), "degraded");
  EXPECT_EQ(describe(CameraState::kOut), "out");
  EXPECT_EQ(describe(CameraReason::kNone), "");
  EXPECT_EQ(describe(CameraReason::kNoImages), "no-images");
  EXPECT_EQ(describe(CameraReason::kOverExposed), "over-exposed");
  EXPECT_EQ(describe(CameraReason::kFewFeatures), "few-features");
}

}  // namespace
}  // namespace bslam::tracking
