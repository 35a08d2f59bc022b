#include "session/rig_report.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "base/random.h"
#include "rig_formats/rig_file.h"
#include "rig_formats/rig_warnings.h"
#include "session/extrinsics_check.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

namespace fs = std::filesystem;
using geometry::SE3;

camera::Camera pinhole(double f) { return {"p", camera::Pinhole({f, f, 319.5, 239.5}), 640, 480, 0, ""}; }

// A stereo pair in a body frame turned and shifted against it.
camera::Rig stereo() {
  const SE3 T_body_cam0(geometry::so3_exp({0.4, -1.0, 0.7}), {0.2, -0.1, 0.3});
  const SE3 step(geometry::so3_exp({0.02, -0.05, 0.01}), {0.12, 0.01, -0.01});
  return camera::Rig({{pinhole(300), T_body_cam0}, {pinhole(330), T_body_cam0 * step}});
}

// Keypoints of points ahead, with a descriptor of its own for each, and as many of one camera alone.
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

TEST(ExtrinsicsCheck, FindsWhatIsMeant) {
  const camera::Rig rig = stereo();
  const auto views = views_of(rig);
  EXPECT_EQ(judged(rig, views).verdict, Convention::kAsGiven);
  EXPECT_EQ(judged(rig, views).agreeing[0], 150);
  EXPECT_EQ(judged(rig_formats::with_inverse_extrinsics(rig), views).verdict, Convention::kInverse);
  const SE3 wrong_step = rig.body_from_cam(0) * rig.rig_from_cam(1).inverse();
  EXPECT_EQ(judged(camera::Rig({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), wrong_step}}), views).verdict,
            Convention::kPairInverse);
  const std::array exchange = {1, 0};
  const camera::Rig swapped = rig.subset(exchange);
  EXPECT_EQ(judged(swapped, views).verdict, Convention::kSwapped);
  EXPECT_EQ(judged(rig_formats::with_inverse_extrinsics(swapped), views).verdict, Convention::kSwappedInverse);
}

TEST(ExtrinsicsCheck, SaysNothingWhereNothingFits) {
  const camera::Rig rig = stereo();
  auto views = views_of(rig);
  EXPECT_FALSE(judged(rig, {views[0], feature::Detections()}).verdict);
  std::rotate(views[1].pixel.begin(), views[1].pixel.begin() + 1, views[1].pixel.end());  // every match is wrong
  const PairEvidence evidence = judged(rig, views);
  EXPECT_EQ(evidence.matches, 150);
  EXPECT_FALSE(evidence.verdict);
}

TEST(ExtrinsicsCheck, SaysHowFarACameraIsTurned) {
  const camera::Rig rig = stereo();
  const SE3 turned(geometry::so3_exp({0.02, 0.06, -0.03}), Eigen::Vector3d::Zero());  // 4 degrees
  const camera::Rig wrong({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1) * turned}});
  const PairEvidence evidence = judged(wrong, views_of(rig));
  EXPECT_FALSE(evidence.verdict);
  ASSERT_TRUE(evidence.other);
  EXPECT_GT(evidence.other->agreeing, 140);
  EXPECT_NEAR(evidence.other->turned_deg, 4.0, 0.05);
  EXPECT_LT(evidence.other->displaced_deg, 2.0);
  EXPECT_NE(describe_evidence(std::array{evidence}).find("warning: the images do not fit"), std::string::npos);
}

TEST(ExtrinsicsCheck, SaysHowFarACameraIsDisplaced) {
  const camera::Rig rig = stereo();
  const SE3 step = rig.body_from_cam(0).inverse() * rig.body_from_cam(1);
  const SE3 above(step.rotation(), {step.translation().y(), step.translation().x(), step.translation().z()});
  const camera::Rig wrong({{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(0) * above}});
  const PairEvidence evidence = judged(wrong, views_of(rig));
  ASSERT_TRUE(evidence.other);
  EXPECT_LT(evidence.other->turned_deg, 0.1);
  EXPECT_NEAR(evidence.other->displaced_deg, 80.5, 2.0);  // between (12, 1, -1) and (1, 12, -1) cm
}

// Too few that fit as given for a verdict are still held against another pose.
TEST(ExtrinsicsCheck, IsNotAlarmedByAFewMoreMatchesElsewhere) {
  const camera::Rig rig = stereo();
  auto views = views_of(rig);
  for (feature::Detections& v : views) v.pixel.resize(40), v.descriptor.resize(40);
  for (std::size_t i = 0; i < 16; ++i)
    views[1].pixel[i] += Eigen::Vector2f(17.0f * static_cast<float>(i % 5), 90.0f - 11.0f * static_cast<float>(i));
  const PairEvidence evidence = judged(rig, views);
  EXPECT_LT(evidence.agreeing[0], 28);
  EXPECT_FALSE(evidence.other);
  EXPECT_EQ(describe_evidence(std::array{evidence}).find("warning"), std::string::npos);
}

TEST(ExtrinsicsCheck, SaysHowManyPairsItCouldJudge) {
  const PairEvidence good{
      .first = 0, .second = 1, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  const PairEvidence apart{.first = 0, .second = 2, .matches = 10};
  const std::string said = describe_evidence(std::array{good, apart});
  EXPECT_NE(said.find("1 of 2 pairs could not be judged: nothing is known of camera 2\n"), std::string::npos) << said;
  const PairEvidence also{
      .first = 1, .second = 2, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  EXPECT_NE(describe_evidence(std::array{good, apart, also}).find("1 of 3 pairs could not be judged\n"),
            std::string::npos);
}

TEST(ExtrinsicsCheck, SpeaksOfTheMostFrequentFault) {
  PairEvidence good{
      .first = 0, .second = 1, .matches = 100, .agreeing = {90, 1, 2, 3, 4}, .verdict = Convention::kAsGiven};
  EXPECT_NE(describe_evidence(std::array{good}).find("the extrinsics fit as given"), std::string::npos);
  PairEvidence bad = good;
  bad.agreeing = {2, 90, 0, 0, 0};
  bad.verdict = Convention::kInverse;
  const std::string mixed = describe_evidence(std::array{good, bad});
  EXPECT_NE(
      mixed.find(
          "warning: the images of cameras 0 and 1 do not fit the extrinsics; they fit with every transform inverted"),
      std::string::npos)
      << mixed;
  EXPECT_NE(mixed.find("; 1 of 2 pairs fit as given"), std::string::npos) << mixed;
  bad.verdict.reset();
  EXPECT_NE(describe_evidence(std::array{bad}).find("nothing can be said"), std::string::npos);
}

class RigReport : public testing::Test {
 protected:
  RigReport() : folder_(fs::temp_directory_path() / ("bslam_rig_report_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~RigReport() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(RigReport, IsTextOrJson) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < 2; ++i) {
    cameras.push_back({stereo().camera(i), stereo().body_from_cam(i)});
    cameras.back().camera.name = "eye" + std::to_string(i);
  }
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(cameras), folder_ / "rig.yaml"));
  const auto text = report_rig({.file = (folder_ / "rig.yaml").string()});
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("camera 1: eye1"), std::string::npos);
  const auto json = report_rig({.file = (folder_ / "rig.yaml").string(), .json = true});
  const auto parsed = nlohmann::json::parse(*json);
  EXPECT_EQ(parsed["format"], "bslam");
  EXPECT_EQ(parsed["cameras"][1]["name"], "eye1");
  EXPECT_NEAR(parsed["cameras"][1]["position_cam0"][0].get<double>(), 0.12, 1e-9);
  EXPECT_NEAR(parsed["baselines"][0]["length_m"].get<double>(), std::sqrt(0.12 * 0.12 + 2e-4), 1e-9);
  EXPECT_TRUE(parsed["warnings"].empty());
  EXPECT_FALSE(report_rig({.file = (folder_ / "none.yaml").string()}));
}

TEST_F(RigReport, NamesAMaskThatCannotBeUsed) {
  camera::RigCamera camera{stereo().camera(0u), stereo().body_from_cam(0)};
  camera.camera.mask_file = (folder_ / "none.png").string();
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig({camera}), folder_ / "rig.yaml"));
  const auto text = report_rig({.file = (folder_ / "rig.yaml").string()});
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("warning: mask of "), std::string::npos) << *text;
  EXPECT_NE(text->find("none.png"), std::string::npos) << *text;
}

// The whole way: images, features, verdict.
TEST_F(RigReport, TestsTheExtrinsicsAgainstImages) {
  ThreadPool pool(2);
  const simulator::SimulationRequest request{.folder = folder_ / "data",
                                             .rig = synthetic::ring_rig(2, 240),
                                             .recording = {.duration_s = 0.4, .rate_hz = 10},
                                             .tour = {.duration_s = 0.4},
                                             .imaging = {},
                                             .world = {.texel = 0.03, .light_texel = 0.8, .ambient_rays = 2}};
  ASSERT_TRUE(simulator::write_simulation(request, pool).ok());
  const std::string images = (folder_ / "data").string();
  const auto good = report_rig({.file = images, .images = images});
  ASSERT_TRUE(good) << good.error().message();
  EXPECT_NE(good->find("the extrinsics fit as given"), std::string::npos) << *good;
  const camera::Rig rig = rig_formats::read_rig(images).value();
  ASSERT_TRUE(rig_formats::write_rig(rig_formats::with_inverse_extrinsics(rig), folder_ / "wrong.yaml"));
  const auto wrong = report_rig({.file = (folder_ / "wrong.yaml").string(), .images = images});
  EXPECT_NE(wrong->find("they fit with"), std::string::npos) << *wrong;
  std::vector<camera::RigCamera> late{{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1)}};
  late[1].camera.time_offset_ns = 15'000'000;
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(late), folder_ / "late.yaml"));
  const auto apart = report_rig({.file = (folder_ / "late.yaml").string(), .images = images});
  ASSERT_TRUE(apart) << apart.error().message();
  EXPECT_NE(apart->find("never taken together"), std::string::npos) << *apart;
}

}  // namespace
}  // namespace bslam::session
