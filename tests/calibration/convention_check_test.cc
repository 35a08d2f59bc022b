#include "calibration/convention_check.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "calibration/rig_warnings.h"
#include "camera/stereo_rig.h"
#include "geometry/so3.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;

// Keypoints of random points in front of the cameras; every point has a unique descriptor.
std::array<feature::Detections, 2> views_of(const camera::Rig& rig) {
  Random random(1);
  std::array<feature::Detections, 2> views;
  while (views[0].size() < 150) {
    const Eigen::Vector3d p(random.uniform(-3, 3), random.uniform(-2, 2), random.uniform(1, 5));
    feature::Descriptor descriptor;
    for (auto& word : descriptor) word = random.next();
    std::array<std::optional<Eigen::Vector2d>, 2> pixels;
    for (std::size_t c = 0; c < 2; ++c) pixels[c] = rig.camera(c).project(rig.cam_from_rig(c) * p);
    for (std::size_t c = 0; c < 2; ++c) {
      if (!pixels[0] || !pixels[1] || !rig.camera(0u).contains(*pixels[0]) || !rig.camera(1u).contains(*pixels[1]))
        continue;
      views[c].pixel.push_back(pixels[c]->cast<float>());
      views[c].descriptor.push_back(descriptor);
    }
  }
  return views;
}

PairEvidence judged(const camera::Rig& calibration, const std::array<feature::Detections, 2>& views) {
  return judge_pair(calibration, 0, 1, std::span(&views[0], 1), std::span(&views[1], 1));
}

TEST(ConventionCheck, FindsTheIntendedConvention) {
  const camera::Rig rig = camera::stereo_rig();
  const auto views = views_of(rig);
  EXPECT_EQ(judged(rig, views).verdict, Convention::kAsGiven);
  EXPECT_EQ(judged(rig, views).agreeing[0], 150);
  EXPECT_EQ(judged(with_inverse_extrinsics(rig), views).verdict, Convention::kInverse);
  const SE3 wrong_step = rig.body_from_cam(0) * rig.rig_from_cam(1).inverse();
  EXPECT_EQ(judged(camera::Rig({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), wrong_step}}), views).verdict,
            Convention::kPairInverse);
  const std::array exchange = {1, 0};
  const camera::Rig swapped = rig.subset(exchange);
  EXPECT_EQ(judged(swapped, views).verdict, Convention::kSwapped);
  EXPECT_EQ(judged(with_inverse_extrinsics(swapped), views).verdict, Convention::kSwappedInverse);
}

std::array<feature::Detections, 2> mirrored(std::array<feature::Detections, 2> views, const camera::Rig& rig) {
  for (std::size_t c = 0; c < 2; ++c) {
    for (auto& pixel : views[c].pixel) pixel.x() = static_cast<float>(rig.camera(c).width - 1) - pixel.x();
  }
  return views;
}

// Mirrored images of both cameras fit each other as well as the true ones.
TEST(ConventionCheck, FindsThatTheImagesOfBothCamerasAreMirrored) {
  const camera::Rig rig = camera::stereo_rig();
  const PairEvidence evidence = judged(rig, mirrored(views_of(rig), rig));
  EXPECT_EQ(evidence.verdict, Convention::kMirrored) << describe_pair(evidence);
  EXPECT_NE(describe_evidence(std::array{evidence})
                .find("150 of 150 matches are consistent with the calibration if the images of both cameras are "
                      "mirrored left to right; "),
            std::string::npos)
      << describe_pair(evidence);
}

TEST(ConventionCheck, FindsThatTheImagesOfBothCamerasAreUpsideDown) {
  const camera::Rig rig = camera::stereo_rig();
  auto views = mirrored(views_of(rig), rig);
  for (std::size_t c = 0; c < 2; ++c) {
    for (auto& pixel : views[c].pixel) pixel.y() = static_cast<float>(rig.camera(c).height - 1) - pixel.y();
  }
  const PairEvidence evidence = judged(rig, views);
  EXPECT_EQ(evidence.verdict, Convention::kUpsideDown) << describe_pair(evidence);
  EXPECT_NE(describe_pair(evidence).find("150 of 150 matches are consistent with the calibration if the images of both "
                                         "cameras are rotated by 180 degrees; "),
            std::string::npos)
      << describe_pair(evidence);
}

// Of cameras side by side it cannot be told whether they are exchanged, mirrored or upside down, and all is said.
TEST(ConventionCheck, MirroredImagesOfASymmetricPairMayBeExchangedOnes) {
  const camera::Rig stereo = camera::stereo_rig();
  const SE3 step(geometry::so3_exp(Eigen::Vector3d::Zero()), {0.12, 0, 0});
  const SE3 body = stereo.body_from_cam(0);
  const camera::Rig rig({{stereo.camera(0u), body}, {stereo.camera(0u), body * step}});
  const PairEvidence evidence = judged(rig, mirrored(views_of(rig), rig));
  ASSERT_TRUE(evidence.verdict);
  EXPECT_NE(*evidence.verdict, Convention::kAsGiven);
  EXPECT_NE(
      describe_pair(evidence).find("exchanged, or if the images of both cameras are mirrored left to right, or if "
                                   "the images of both cameras are rotated by 180 degrees; "),
      std::string::npos)
      << describe_pair(evidence);
}

// Cameras 1 and 2 of a ring are exchanged: the images of cameras 0 and 1 are those of cameras 0 and 2.
TEST(ConventionCheck, NamesTheCamerasThatWereExchanged) {
  const camera::Rig stereo = camera::stereo_rig();
  const SE3 turned(geometry::so3_exp({0, 1.2, 0}), Eigen::Vector3d(0.1, 0, 0.2));
  camera::Camera third = stereo.camera(1u);
  third.name = "third";
  const camera::Rig wrong({{stereo.camera(0u), stereo.body_from_cam(0)},
                           {third, stereo.body_from_cam(1) * turned},
                           {stereo.camera(1u), stereo.body_from_cam(1)}});
  const PairEvidence evidence = judged(wrong, views_of(stereo));
  EXPECT_FALSE(evidence.verdict || evidence.other);
  ASSERT_TRUE(evidence.exchanged);
  EXPECT_EQ(evidence.exchanged->agreeing, 150);
  EXPECT_EQ(evidence.exchanged->cameras, (std::array{stereo.camera(0u).name, stereo.camera(1u).name}));
  EXPECT_NE(describe_pair(evidence).find("150 of 150 matches are consistent with the calibrations of "),
            std::string::npos);
  EXPECT_NE(describe_evidence(std::array{evidence}).find("they are consistent with exchanged cameras"),
            std::string::npos);
}

TEST(ConventionCheck, HasNoVerdictIfNoConventionFits) {
  const camera::Rig rig = camera::stereo_rig();
  auto views = views_of(rig);
  EXPECT_FALSE(judged(rig, {views[0], feature::Detections()}).verdict);
  std::rotate(views[1].pixel.begin(), views[1].pixel.begin() + 1, views[1].pixel.end());  // every match is wrong
  const PairEvidence evidence = judged(rig, views);
  EXPECT_EQ(evidence.matches, 150);
  EXPECT_FALSE(evidence.verdict);
}

TEST(ConventionCheck, ReportsTheRotationOfACamera) {
  const camera::Rig rig = camera::stereo_rig();
  const SE3 rotated(geometry::so3_exp({0.02, 0.06, -0.03}), Eigen::Vector3d::Zero());  // 4 degrees
  const camera::Rig wrong({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1) * rotated}});
  const PairEvidence evidence = judged(wrong, views_of(rig));
  EXPECT_FALSE(evidence.verdict);
  ASSERT_TRUE(evidence.other);
  EXPECT_GT(evidence.other->agreeing, 140);
  EXPECT_NEAR(evidence.other->rotated_deg, 4.0, 0.05);
  EXPECT_LT(evidence.other->displaced_deg, 2.0);
  EXPECT_NE(describe_evidence(std::array{evidence}).find("warning: the images contradict the extrinsics"),
            std::string::npos);
}

// A calibration that is wrong by a tenth of a degree is wrong by more pixels at a high resolution, but not more wrong.
TEST(ConventionCheck, ToleratesSmallAnglesAtAnyResolution) {
  const camera::Rig stereo = camera::stereo_rig();
  const camera::Camera large{"large", camera::Pinhole({3000, 3000, 3199.5, 2399.5}), 6400, 4800, 0, ""};
  const SE3 rotated(geometry::so3_exp({0.0017, 0, 0}), Eigen::Vector3d::Zero());
  const camera::Rig rig({{large, stereo.body_from_cam(0)}, {large, stereo.body_from_cam(1)}});
  const camera::Rig wrong({{large, stereo.body_from_cam(0)}, {large, stereo.body_from_cam(1) * rotated}});
  const PairEvidence evidence = judged(wrong, views_of(rig));
  EXPECT_EQ(evidence.verdict, Convention::kAsGiven) << describe_pair(evidence);
}

TEST(ConventionCheck, ReportsTheDisplacementOfACamera) {
  const camera::Rig rig = camera::stereo_rig();
  const SE3 step = rig.body_from_cam(0).inverse() * rig.body_from_cam(1);
  const SE3 above(step.rotation(), {step.translation().y(), step.translation().x(), step.translation().z()});
  const camera::Rig wrong({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(0) * above}});
  const PairEvidence evidence = judged(wrong, views_of(rig));
  ASSERT_TRUE(evidence.other);
  EXPECT_LT(evidence.other->rotated_deg, 0.1);
  EXPECT_NEAR(evidence.other->displaced_deg, 80.5, 2.0);  // between (12, 1, -1) and (1, 12, -1) cm
}

// Too few matches consistent with the calibration for a verdict are not yet evidence of another pose.
TEST(ConventionCheck, IgnoresOtherPosesWithSlightlyMoreMatches) {
  const camera::Rig rig = camera::stereo_rig();
  auto views = views_of(rig);
  for (feature::Detections& v : views) v.pixel.resize(40), v.descriptor.resize(40);
  for (std::size_t i = 0; i < 16; ++i)
    views[1].pixel[i] += Eigen::Vector2f(17.0f * static_cast<float>(i % 5), 90.0f - 11.0f * static_cast<float>(i));
  const PairEvidence evidence = judged(rig, views);
  EXPECT_LT(evidence.agreeing[0], 28);
  EXPECT_FALSE(evidence.other);
  EXPECT_EQ(describe_evidence(std::array{evidence}).find("contradict"), std::string::npos);
}

TEST(ConventionCheck, ReportsTheNumberOfTestedPairs) {
  const PairEvidence good{
      .first = 0, .second = 1, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  const PairEvidence apart{.first = 0, .second = 2, .matches = 10};
  const std::string text = describe_evidence(std::array{good, apart});
  EXPECT_NE(text.find("  1 of 2 pairs could be tested, and the images are consistent with the extrinsics of this one\n"
                      "  not tested because of too few matches: cameras 0 and 2\n"
                      "  nothing is known of the extrinsics of cameras in no tested pair: 2\n"),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("the extrinsics are consistent with the images"), std::string::npos);
  const PairEvidence also{
      .first = 1, .second = 2, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  const std::string most = describe_evidence(std::array{good, apart, also});
  EXPECT_NE(most.find("  2 of 3 pairs could be tested, and the images are consistent with the extrinsics of these\n"),
            std::string::npos);
  EXPECT_EQ(most.find("nothing is known"), std::string::npos);
}

TEST(ConventionCheck, SaysWhyAPairWasNotTestedAndWarnsIfItHasMuchOverlap) {
  const PairEvidence good{
      .first = 0, .second = 1, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  const PairEvidence apart{.first = 0, .second = 2, .overlap = 0.01, .matches = 10};
  const PairEvidence blank{.first = 1, .second = 2, .overlap = 0.5, .matches = 10};
  EXPECT_EQ(describe_pair(apart),
            "not tested: too few matches for a decision (10); the calibrated views overlap by 1 %");
  EXPECT_EQ(describe_pair(blank),
            "not tested: too few matches for a decision (10); the calibrated views overlap by 50 %");
  EXPECT_EQ(describe_evidence(std::array{good, apart}).find("warning"), std::string::npos);
  EXPECT_NE(describe_evidence(std::array{good, apart})
                .find("  not tested because of views that hardly overlap: cameras 0 and 2\n"),
            std::string::npos);
  EXPECT_NE(describe_evidence(std::array{good, apart, blank})
                .find("warning: 1 of 2 pairs with much overlap could not be tested: cameras 1 and 2\n"),
            std::string::npos);
}

TEST(ConventionCheck, ReportsTheMostFrequentFault) {
  PairEvidence good{
      .first = 0, .second = 1, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  EXPECT_NE(describe_evidence(std::array{good}).find("the extrinsics are consistent with the images"),
            std::string::npos);
  PairEvidence bad = good;
  bad.agreeing = {2, 90, 0, 0, 0};
  bad.verdict = Convention::kInverse;
  const std::string mixed = describe_evidence(std::array{good, bad});
  EXPECT_NE(
      mixed.find(
          "warning: the images of cameras 0 and 1 contradict the extrinsics; they are consistent with them with every "
          "transform inverted"),
      std::string::npos)
      << mixed;
  EXPECT_NE(mixed.find("; 1 of 2 pairs are consistent as given"), std::string::npos) << mixed;
  bad.verdict.reset();
  EXPECT_NE(describe_evidence(std::array{bad}).find("the extrinsics could not be tested"), std::string::npos);
}

}  // namespace
}  // namespace bslam::calibration
