// Reading and writing of calibrations in the formats of other programs.
#include "rig_formats/rig_formats.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "base/random.h"
#include "camera/camera_description.h"
#include "camera/test_cameras.h"
#include "geometry/random_transforms.h"

namespace bslam::rig_formats {
namespace {

bool holds(RigFormat format, const camera::CameraModel& model) {
  const std::size_t coefficients = camera::distortion(model).size();
  const bool radtan = std::holds_alternative<camera::PinholeRadTan>(model);
  const bool pinhole = std::holds_alternative<camera::Pinhole>(model);
  const bool fov = std::holds_alternative<camera::Fov>(model);
  switch (format) {
    case RigFormat::kKalibr:
      return !radtan || coefficients == 4;
    case RigFormat::kOpenvins:
      return camera::is_opencv_model(model) && !pinhole && (!radtan || coefficients == 4);
    case RigFormat::kOrbslam3:
      return camera::is_opencv_model(model) && (!radtan || coefficients <= 5);
    case RigFormat::kOkvis2:
      return camera::is_opencv_model(model) && !pinhole;
    case RigFormat::kEuroc:
      return camera::is_opencv_model(model);
    case RigFormat::kColmap:
      return camera::is_opencv_model(model) || fov;
    case RigFormat::kBasalt:
      return !fov;
    default:
      return true;
  }
}

// Rigs that the format can store, with all its models at random poses.
std::vector<camera::Rig> rigs_for(RigFormat format) {
  Random random(7);
  std::vector<camera::RigCamera> cameras;
  for (camera::Camera& camera : camera::test_cameras()) {
    if (!holds(format, camera.model)) continue;
    camera.name = "cam" + std::to_string(cameras.size());
    const bool stays = format == RigFormat::kColmap && cameras.empty();
    cameras.push_back({camera, stays ? SE3() : geometry::random_se3(random, 0.5)});
  }
  if (format != RigFormat::kOrbslam3) return {camera::Rig(cameras)};
  std::vector<camera::Rig> pairs;  // pairs of equal resolution and kind
  for (const camera::RigCamera& c : cameras) {
    camera::RigCamera other{c.camera, geometry::random_se3(random, 0.5)};
    camera::RigCamera first = c;
    first.camera.name = "cam0";
    other.camera.name = "cam1";
    pairs.push_back(camera::Rig({first, other}));
  }
  return pairs;
}

void expect_near(const camera::Rig& a, const camera::Rig& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const camera::Camera &ca = a.camera(i), &cb = b.camera(i);
    EXPECT_EQ(camera::model_name(ca.model), camera::model_name(cb.model));
    const camera::Intrinsics &ka = camera::intrinsics(ca.model), &kb = camera::intrinsics(cb.model);
    EXPECT_LE(std::abs(ka.fx - kb.fx) + std::abs(ka.fy - kb.fy), tolerance) << i;
    EXPECT_LE(std::abs(ka.cx - kb.cx) + std::abs(ka.cy - kb.cy), tolerance) << i;
    std::vector<double> da = camera::distortion(ca.model), db = camera::distortion(cb.model);
    const std::size_t count = std::max(da.size(), db.size());  // trailing zeros may be written
    da.resize(count), db.resize(count);
    for (std::size_t k = 0; k < count; ++k) EXPECT_LE(std::abs(da[k] - db[k]), tolerance) << i;
    EXPECT_EQ((std::array{ca.width, ca.height}), (std::array{cb.width, cb.height}));
    EXPECT_EQ(ca.time_offset_ns, cb.time_offset_ns);
    EXPECT_LE((a.body_from_cam(i).matrix() - b.body_from_cam(i).matrix()).cwiseAbs().maxCoeff(), tolerance) << i;
  }
}

class RigFormatOf : public RigFormats, public testing::WithParamInterface<RigFormat> {
 protected:
  fs::path out() const {
    const bool folder = GetParam() == RigFormat::kEuroc || GetParam() == RigFormat::kColmap;
    return folder_.path() / (folder ? "out" : "out.txt");
  }
};
INSTANTIATE_TEST_SUITE_P(Writable, RigFormatOf, testing::ValuesIn(writable_formats().begin(), writable_formats().end()),
                         [](const auto& instance) { return std::string(format_name(instance.param)); });

TEST_P(RigFormatOf, RoundTrips) {
  for (const camera::Rig& rig : rigs_for(GetParam())) {
    ASSERT_GE(rig.size(), 2u);
    const auto notes = write_rig_as(rig, GetParam(), out());
    ASSERT_TRUE(notes) << notes.error().message();
    EXPECT_TRUE(notes->empty());
    const auto again = read_rig_file(out());
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_EQ(again->format, GetParam());
    expect_near(rig, again->rig, 1e-9);
  }
}

TEST_P(RigFormatOf, RejectsContentItCannotStore) {
  const bool all = GetParam() == RigFormat::kBslam;
  camera::Camera camera = camera::test_cameras()[1];
  camera.mask_file = "/mask.png";
  const auto masked = write_rig_as(camera::Rig({{camera, SE3()}}), GetParam(), out());
  EXPECT_EQ(masked.ok(), all);
  if (!all) {
    EXPECT_EQ(masked.error().key, camera.name);
    EXPECT_NE(masked.error().found.find("a mask"), std::string::npos);
    EXPECT_NE(masked.error().expected.find("--drop mask"), std::string::npos);
  }
  camera.mask_file.clear();
  camera.time_offset_ns = 1;
  camera::Camera plain = camera;
  plain.time_offset_ns = 0;
  plain.name = "plain";
  const bool each = all || GetParam() == RigFormat::kKalibr || GetParam() == RigFormat::kOpenvins;
  EXPECT_EQ(write_rig_as(camera::Rig({{camera, SE3()}, {plain, SE3()}}), GetParam(), out()).ok(), each);
}

// A rig that was read is bitwise identical after conversion to another format that stores the same numbers.
TEST_F(RigFormats, ConversionsAreBitwiseExact) {
  for (const RigFormat format :
       {RigFormat::kBslam, RigFormat::kEuroc, RigFormat::kOpenvins, RigFormat::kOkvis2, RigFormat::kBasalt}) {
    const camera::Rig first = read(rig_to_yaml(rigs_for(format).front())).value().rig;
    const fs::path out = folder_.path() / (format == RigFormat::kEuroc ? "out" : "out.txt");
    ASSERT_TRUE(write_rig_as(first, format, out));
    const camera::Rig again = read_rig_file(out).value().rig;
    expect_near(first, again, 0.0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(first.body_from_cam(i).rotation().coeffs(), again.body_from_cam(i).rotation().coeffs()) << i;
      EXPECT_EQ(first.body_from_cam(i).translation(), again.body_from_cam(i).translation()) << i;
    }
  }
}

TEST(RigTransform, KeepsRightAnglesExactly) {
  const auto T = camera::rigid_transform({0, 0, 1, 0.5, -1, 0, 0, 0.25, 0, -1, 0, 0.125, 0, 0, 0, 1}, "", "");
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_EQ(T->matrix3(), R);
  EXPECT_EQ(camera::rigid_transform(camera::rows_of(SE3()), "", "")->matrix(), Eigen::Matrix4d::Identity());
}

TEST(RigTransform, RoundTripsThroughItsMatrixBitwise) {
  Random random(3);
  for (int i = 0; i < 50000; ++i) {
    const auto first = camera::rigid_transform(camera::rows_of(geometry::random_se3(random, 1.0)), "", "");
    const auto again = camera::rigid_transform(camera::rows_of(*first), "", "");
    ASSERT_EQ(first->rotation().coeffs(), again->rotation().coeffs());
    ASSERT_EQ(first->translation(), again->translation());
    const auto from_quaternion = camera::rigid_transform(first->rotation(), first->translation(), "", "");
    ASSERT_EQ(first->rotation().coeffs(), from_quaternion->rotation().coeffs());
  }
}

TEST(RigFormat, IsDeterminedByTheFileName) {
  EXPECT_EQ(format_of_output("rig.yaml"), RigFormat::kBslam);
  EXPECT_EQ(format_of_output("rig.json"), RigFormat::kBasalt);
  EXPECT_EQ(format_of_output("folder/"), RigFormat::kEuroc);
  EXPECT_EQ(writable_format("colmap"), RigFormat::kColmap);
  EXPECT_FALSE(writable_format("kitti"));
}

TEST_F(RigFormats, WithoutRemovesTheGivenPart) {
  camera::Camera camera = camera::test_cameras()[1];
  camera.mask_file = "/mask.png";
  camera.time_offset_ns = 5;
  const SE3 T(geometry::so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}), step(geometry::Quaterniond::Identity(), {0.1, 0, 0});
  const camera::Rig rig({{camera, T}, {camera, T * step}});
  EXPECT_EQ(without(rig, Droppable::kMasks).camera(index(1)).mask_file, "");
  EXPECT_EQ(without(rig, Droppable::kTimeOffsets).camera(index(1)).time_offset_ns, 0);
  const camera::Rig bare = without(rig, Droppable::kBodyFrame);
  EXPECT_EQ(bare.body_from_cam(0).matrix(), Eigen::Matrix4d::Identity());
  EXPECT_LT((bare.body_from_cam(1).translation() - Vector3d(0.1, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(bare.camera(index(1)).time_offset_ns, 5);
}

// A refinement of the principal point of camera 0 turns its frame, which then is not the rig frame.
TEST_F(RigFormats, ExtrinsicsRelativeToATurnedCamera0AreKeptInEveryFormat) {
  const SE3 T_cam0_rig(geometry::so3_exp({0.01, -0.02, 0}), Vector3d::Zero());
  const SE3 T_cam0_cam1(geometry::so3_exp({0.1, 0.2, 0.3}), {0.2, 0.01, -0.02});
  camera::RigCamera first{camera::test_cameras()[1], SE3()}, second{first.camera, T_cam0_cam1};
  second.camera.name = "second";
  const camera::Rig rig({first, second}, T_cam0_rig);
  for (const auto format : {RigFormat::kBslam, RigFormat::kKalibr, RigFormat::kOpenvins, RigFormat::kOrbslam3,
                            RigFormat::kOkvis2, RigFormat::kBasalt, RigFormat::kColmap, RigFormat::kEuroc}) {
    const fs::path out = folder_.path() / std::to_string(static_cast<int>(format)) / "rig.yaml";
    fs::create_directories(out.parent_path());
    const auto written = write_rig_as(rig, format, out);
    ASSERT_TRUE(written) << written.error().message();
    const auto again = read_rig_file(out);
    ASSERT_TRUE(again) << again.error().message();
    const SE3 found = again->rig.cam_from_rig(0) * again->rig.rig_from_cam(1);
    EXPECT_LT((found.matrix() - T_cam0_cam1.matrix()).cwiseAbs().maxCoeff(), 1e-6) << static_cast<int>(format);
  }
  const camera::Rig bare = without(rig, Droppable::kBodyFrame);
  EXPECT_TRUE(bare.body_from_cam(0).matrix().isIdentity(1e-12));
  EXPECT_TRUE(bare.body_from_cam(1).matrix().isApprox(T_cam0_cam1.matrix(), 1e-12));
}

// ---- Kalibr and OpenVINS

constexpr const char* kKalibr = R"(cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.1]
  - [0.0, 0.0, -1.0, 0.2]
  - [1.0, 0.0, 0.0, 0.3]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.0, 457.0, 367.0, 248.0]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.0019
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.2, 0.6, 350.0, 351.0, 366.0, 249.0]
  resolution: [752, 480]
)";

// The second camera has no topic.
TEST_F(RigFormats, KalibrNamesTopicsWhichFormatsWithTopicsKeep) {
  const auto rig = read_with(kKalibr, "rostopic: /cam0/image_raw", "rostopic: '/front: 1'");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->topics, (std::vector<std::string>{"/front: 1", ""}));
  const fs::path out = folder_.path() / "out.yaml";
  ASSERT_TRUE(write_rig_as(rig->rig, RigFormat::kBslam, out, rig->topics));
  EXPECT_EQ(read_rig_file(out)->topics, rig->topics);
  ASSERT_TRUE(write_rig_as(rig->rig, RigFormat::kKalibr, out, rig->topics));
  EXPECT_EQ(read_rig_file(out)->topics, (std::vector<std::string>{"/front: 1", "/cam1/image_raw"}));
  const auto joined = read_joined_rigs(std::vector<fs::path>{folder_.path() / "rig.yaml", out});
  ASSERT_TRUE(joined) << joined.error().message();
  EXPECT_EQ(joined->topics, (std::vector<std::string>{"/front: 1", "", "/front: 1", "/cam1/image_raw"}));
}

TEST_F(RigFormats, KalibrChainsPosesAndTimeShifts) {
  const auto file = read(kKalibr);
  ASSERT_TRUE(file) << file.error().message();
  const camera::Rig& rig = file->rig;
  EXPECT_EQ(file->format, RigFormat::kKalibr);
  EXPECT_TRUE(file->notes.empty());
  ASSERT_EQ(rig.size(), 2u);
  EXPECT_EQ(rig.camera(index(0)).time_offset_ns, 1'900'000);
  EXPECT_EQ(camera::model_name(rig.camera(index(1)).model), "double-sphere");
  EXPECT_EQ(camera::distortion(rig.camera(index(1)).model), (std::vector{-0.2, 0.6}));
  EXPECT_EQ(camera::intrinsics(rig.camera(index(1)).model).fy, 351);
  // A point of camera 0 is shifted by -0.11 in camera 1, so camera 1 is 0.11 to the right.
  EXPECT_LT((rig.rig_from_cam(1).translation() - Vector3d(0.11, 0, 0)).norm(), 1e-12);
  // T_cam_imu maps the IMU's x axis to the camera's z.
  EXPECT_LT((rig.body_from_cam(0).rotation() * Vector3d::UnitZ() - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((rig.body_from_cam(0).inverse() * Vector3d::Zero() - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
}

TEST_F(RigFormats, KalibrWithoutImuUsesCamera0AsBody) {
  const std::string text(kKalibr);
  const auto file = read(text.substr(0, 6) + text.substr(text.find("  cam_overlaps")));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->rig.body_from_cam(0).matrix(), Eigen::Matrix4d::Identity());
  ASSERT_EQ(file->notes.size(), 1u);
}

TEST_F(RigFormats, KalibrWithAGapInItsNumbersIsRejected) {
  std::string text(kKalibr);
  text.replace(text.find("cam1:"), 5, "cam3:");
  const auto file = read(text);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().key, "cam1");
  EXPECT_NE(file.error().message().find("cam3"), std::string::npos) << file.error().message();
}

TEST_F(RigFormats, KalibrWithACameraTwiceIsRejected) {
  std::string text(kKalibr);
  text += text.substr(text.find("cam1:"));
  const auto file = read(text);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().key, "cam1");
  EXPECT_EQ(file.error().found, "a repeated key");
}

TEST_F(RigFormats, AByteOrderMarkIsIgnored) {
  const auto file = read("\xEF\xBB\xBF" + std::string(kKalibr));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->rig.size(), read(kKalibr)->rig.size());
}

TEST_F(RigFormats, KalibrOmniBecomesTheUnifiedModel) {
  const std::string text = R"(cam0:
  camera_model: omni
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [1.3, 540.0, 541.0, 320.0, 240.0]
  resolution: [640, 480]
)";
  const auto file = read(text);
  ASSERT_TRUE(file) << file.error().message();
  const Vector3d p(0.4, -0.3, 0.9);
  const double divisor = p.z() + 1.3 * p.norm();
  EXPECT_LT((file->rig.camera(index(0)).project(p).value() -
             Vector2d(320 + 540 * p.x() / divisor, 240 + 541 * p.y() / divisor))
                .norm(),
            1e-10);
  const auto distorted = read_with(text, "[0.0, 0.0, 0.0, 0.0]", "[-0.1, 0.0, 0.0, 0.0]");
  ASSERT_FALSE(distorted);
  EXPECT_EQ(distorted.error().key, "cam0.distortion_coeffs");
  EXPECT_EQ(distorted.error().found, "omni with distortion");
}

TEST_F(RigFormats, KalibrStoresFovAsADistortionOfThePinhole) {
  const std::string text = R"(cam0:
  camera_model: pinhole
  distortion_coeffs: [0.9271]
  distortion_model: fov
  intrinsics: [256.9, 257.1, 319.5, 239.5]
  resolution: [640, 480]
)";
  const auto file = read(text);
  ASSERT_TRUE(file) << file.error().message();
  const camera::Camera& camera = file->rig.camera(index(0));
  EXPECT_EQ(camera::model_name(camera.model), "fov");
  EXPECT_EQ(camera::distortion(camera.model), std::vector{0.9271});
  EXPECT_EQ(camera::intrinsics(camera.model).fy, 257.1);
  const Error two = read_with(text, "[0.9271]", "[0.9271, 0.0]").error();
  EXPECT_EQ(two.key, "cam0.distortion_coeffs");
  EXPECT_EQ(two.expected, "1, w, for fov");
  EXPECT_EQ(read_with(text, "[0.9271]", "[0.0]").error().expected, "w in [1e-06, 3.14]");
}

TEST_F(RigFormats, KalibrRejectsInvalidValues) {
  struct Case {
    const char *from, *to, *key;
  };
  for (const Case& c :
       {Case{"camera_model: pinhole", "camera_model: telepathic", "cam0.camera_model"},
        Case{"distortion_model: radtan", "distortion_model: fog", "cam0.distortion_model"},
        Case{"[458.0, 457.0,", "[458.0,", "cam0.intrinsics"}, Case{"[-0.2, 0.6, 350.0,", "[350.0,", "cam1.intrinsics"},
        Case{"[-0.2, 0.6, 350.0,", "[-2.0, 0.6, 350.0,", "cam1.distortion_coeffs"},
        Case{"[0.0, -1.0, 0.0, 0.1]", "[0.0, 1.0, 0.0, 0.1]", "cam0.T_cam_imu"},
        Case{"[0.0, -1.0, 0.0, 0.1]", "[0.0, -1.1, 0.0, 0.1]", "cam0.T_cam_imu"},
        Case{"T_cn_cnm1", "T_cn_cnm2", "cam1.T_cn_cnm1"},
        Case{"resolution: [752, 480]", "size: [752, 480]", "cam0.resolution"},
        Case{"timeshift_cam_imu: 0.0019", "timeshift_cam_imu: late", "cam0.timeshift_cam_imu"}}) {
    const auto file = read_with(kKalibr, c.from, c.to);
    ASSERT_FALSE(file) << c.to;
    EXPECT_EQ(file.error().key, c.key) << file.error().message();
    EXPECT_FALSE(file.error().expected.empty());
  }
}

TEST_F(RigFormats, KalibrRejectsInconsistentTransforms) {
  const std::string wrong =
      "  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.21]\n  - [0.0, 0.0, -1.0, 0.2]\n"
      "  - [1.0, 0.0, 0.0, 0.3]\n  - [0.0, 0.0, 0.0, 1.0]\n  T_cn_cnm1:\n";
  EXPECT_EQ(read_with(kKalibr, "  T_cn_cnm1:\n", wrong).error().key, "cam1.T_cn_cnm1");
  std::string right = wrong;
  right.replace(right.find("0.21"), 4, "-0.01");
  EXPECT_TRUE(read_with(kKalibr, "  T_cn_cnm1:\n", right));
}

TEST_F(RigFormats, OpenvinsStoresCameraToImu) {
  const std::string head = "%YAML:1.0\n\ncam0:\n", rest = R"(
    - [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975]
    - [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768]
    - [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949]
    - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
  resolution: [752, 480]
)";
  const auto file = read(head + "  T_imu_cam: #rotation from camera to IMU" + rest);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kOpenvins);
  EXPECT_EQ(file->rig.body_from_cam(0).translation(), Vector3d(-0.0216401454975, -0.064676986768, 0.00981073058949));
  const auto inverse = read(head + "  T_cam_imu:" + rest);
  EXPECT_EQ(inverse->format, RigFormat::kKalibr);
  EXPECT_LT((inverse->rig.body_from_cam(0).inverse().matrix() - file->rig.body_from_cam(0).matrix()).norm(), 1e-12);
}

TEST_F(RigFormats, OpenvinsWritesNoDistortionAsZeros) {
  const camera::Rig rig({{camera::Camera{"front", camera::Pinhole({400, 401, 320, 240}), 640, 480, 0, {}}, SE3()}});
  ASSERT_TRUE(write_rig_as(rig, RigFormat::kOpenvins, folder_.path() / "out.yaml"));
  const auto again = read_rig_file(folder_.path() / "out.yaml");
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(camera::model_name(again->rig.camera(index(0)).model), "pinhole-radtan");
  EXPECT_EQ(camera::distortion(again->rig.camera(index(0)).model), std::vector<double>(4, 0.0));
  EXPECT_EQ(camera::intrinsics(again->rig.camera(index(0)).model).fy, 401);
}

// ---- Basalt

constexpr const char* kBasalt = R"({
	"value0": {
		"T_imu_cam": [
			{"px": 0.1, "py": -0.2, "pz":0.3, "qx": 0.5, "qy": -0.5, "qz": 0.5, "qw": -0.5},
			{"px": 0.2, "py": -0.2, "pz": 0.3, "qx": 0.5, "qy": -0.5, "qz": 0.5, "qw": -0.5}
		],
		"intrinsics": [
			{"camera_type": "ds", "intrinsics": {"fx": 349.7, "fy": 348.6, "cx": 365.9, "cy": 249.3, "xi": -0.24, "alpha": 0.567}},
			{"camera_type":"pinhole-radtan8","intrinsics":{"fx":269.7,"fy":269.8,"cx":322.6,"cy":228.9,"k1":0.302,"k2":-0.021,
			 "p1":-0.00025,"p2":6.1e-05,"k3":0.0158,"k4":0.575,"k5":-0.063,"k6":0.034,"rpmax":2.7276}}
		],
		"resolution": [[752, 480], [640, 480]],
		"cam_time_offset_ns": -1500,
		"vignette": []
	}
})";

TEST_F(RigFormats, BasaltIsRead) {
  const auto file = read(kBasalt, "calibration.json");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kBasalt);
  const camera::Rig& rig = file->rig;
  EXPECT_EQ(camera::model_name(rig.camera(index(0)).model), "double-sphere");
  EXPECT_EQ(camera::distortion(rig.camera(index(0)).model), (std::vector{-0.24, 0.567}));
  EXPECT_EQ(camera::distortion(rig.camera(index(1)).model).size(), 8u);
  EXPECT_EQ(rig.camera(index(1)).time_offset_ns, -1500);
  EXPECT_EQ(rig.body_from_cam(0).translation(), Vector3d(0.1, -0.2, 0.3));
  const geometry::Quaterniond q(-0.5, 0.5, -0.5, 0.5);  // w x y z
  EXPECT_LT((rig.body_from_cam(0).matrix3() - q.toRotationMatrix()).norm(), 1e-15);
}

TEST_F(RigFormats, BasaltRejectsInvalidValues) {
  struct Case {
    const char *from, *to, *key;
  };
  for (const Case& c :
       {Case{"\"ds\"", "\"bal\"", "value0.intrinsics[0].camera_type"},
        Case{"\"xi\": -0.24", "\"eta\": 1", "value0.intrinsics[0].intrinsics.xi"},
        Case{"\"xi\": -0.24", "\"xi\": -1.24", "value0.intrinsics[0].intrinsics"},
        Case{"\"qx\": 0.5", "\"qx\": 0.6", "value0.T_imu_cam[0]"},
        Case{"\"qx\": 0.5", "\"qx\": null", "value0.T_imu_cam[0].qx"}, Case{"[752, 480], ", "", "value0.resolution"},
        Case{"[752, 480]", "[752]", "value0.resolution[0]"}, Case{"\"resolution\"", "\"size\"", "value0.resolution"},
        Case{"-1500", "1.5", "value0.cam_time_offset_ns"}}) {
    const auto file = read_with(kBasalt, c.from, c.to);
    ASSERT_FALSE(file) << c.to;
    EXPECT_EQ(file.error().key, c.key) << file.error().message();
  }
  EXPECT_FALSE(read("{\"value0\": {\"T_imu_cam\": "));
}

// ---- KITTI raw: the calibration of 2011_09_26, cameras 00 and 01.

constexpr const char* kKittiRaw =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    "S_00: 1.392000e+03 5.120000e+02\n"
    "K_00: 9.842439e+02 0.000000e+00 6.900000e+02 0.000000e+00 9.808141e+02 2.331966e+02 0.000000e+00 0.000000e+00 "
    "1.000000e+00\n"
    "D_00: -3.728755e-01 2.037299e-01 2.219027e-03 1.383707e-03 -7.233722e-02\n"
    "R_00: 1.000000e+00 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00 0.000000e+00 0.000000e+00 "
    "1.000000e+00\n"
    "T_00: 2.573699e-16 -1.059758e-16 1.614870e-16\n"
    "S_rect_00: 1.242000e+03 3.750000e+02\n"
    "P_rect_00: 7.215377e+02 0.000000e+00 6.095593e+02 0.000000e+00 0.000000e+00 7.215377e+02 1.728540e+02 "
    "0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "S_01: 1.392000e+03 5.120000e+02\n"
    "K_01: 9.895267e+02 0.000000e+00 7.020000e+02 0.000000e+00 9.878386e+02 2.455590e+02 0.000000e+00 0.000000e+00 "
    "1.000000e+00\n"
    "D_01: -3.644661e-01 1.790019e-01 1.148107e-03 -6.298563e-04 -5.314062e-02\n"
    "R_01: 9.993513e-01 1.860866e-02 -3.083487e-02 -1.887662e-02 9.997863e-01 -8.421873e-03 3.067156e-02 8.998467e-03 "
    "9.994890e-01\n"
    "T_01: -5.370000e-01 4.822061e-03 -1.252488e-02\n"
    "S_rect_01: 1.242000e+03 3.750000e+02\n"
    "P_rect_01: 7.215377e+02 0.000000e+00 6.095593e+02 -3.875744e+02 0.000000e+00 7.215377e+02 1.728540e+02 "
    "0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n";

TEST_F(RigFormats, KittiRawChoosesTheRigByItsFolder) {
  const auto at = [&](const std::string& name) { return read(kKittiRaw, name + "/calib_cam_to_cam.txt"); };
  const auto rectified = at("plain");
  ASSERT_TRUE(rectified) << rectified.error().message();
  EXPECT_EQ(rectified->format, RigFormat::kKittiRaw);
  EXPECT_EQ(rectified->rig.camera(index(0)).width, 1242);
  EXPECT_NEAR(rectified->rig.rig_from_cam(1).translation().x(), 387.5744 / 721.5377, 1e-12);
  const auto raw = at("2011_09_26_drive_0039_extract");
  EXPECT_EQ(raw->rig.camera(index(0)).width, 1392);
  EXPECT_EQ(camera::distortion(raw->rig.camera(index(1)).model)[4], -5.314062e-02);
  EXPECT_NEAR(raw->rig.rig_from_cam(1).translation().norm(), 0.537, 1e-3);
  EXPECT_GT(raw->rig.rig_from_cam(1).translation().x(), 0.53);  // camera 01 is to the right
  EXPECT_EQ(at("2011_09_26_drive_0039_sync")->rig.camera(index(0)).width, 1242);
  fs::create_directories(folder_.path() / "date" / "2011_09_26_drive_0039_extract");
  EXPECT_EQ(at("date")->rig.camera(index(0)).width, 1392);
  support::write_image(folder_.path() / "images" / "image_00" / "data" / "0000000000.png", 1392, 512);
  EXPECT_EQ(at("images")->rig.camera(index(0)).width, 1392);
  EXPECT_EQ(read_rig_file(folder_.path() / "images")->rig.size(), 2u);
}

TEST_F(RigFormats, KittiRawRejectsInvalidValues) {
  EXPECT_EQ(read_with(kKittiRaw, "S_rect_00: 1.242000e+03", "S_rect_00:").error().key, "S_rect_00");
  EXPECT_EQ(read_with(kKittiRaw, "P_rect_01: 7.2", "P_rect_01: x7.2").error().found, "x7.215377e+02");
  EXPECT_EQ(read_with(kKittiRaw, "P_rect_01: 7.215377e+02 0.0", "P_rect_01: 7.215377e+02 0.1").error().key,
            "P_rect_01");
}

}  // namespace
}  // namespace bslam::rig_formats
