#include "rig_formats/rig_file.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "camera/test_cameras.h"
#include "geometry/random_transforms.h"
#include "rig_formats/euroc_sensor.h"
#include "support/data_on_disk.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

// Cameras of every model at random poses.
camera::Rig mixed_rig() {
  Random random(1);
  std::vector<camera::RigCamera> cameras;
  for (camera::Camera& camera : camera::test_cameras()) cameras.push_back({camera, geometry::random_se3(random, 0.5)});
  return camera::Rig(std::move(cameras));
}

// The cameras of all_models that EuRoC's format can store.
camera::Rig euroc_rig() {
  const camera::Rig rig = mixed_rig();
  std::vector<int> chosen;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    if (camera::is_opencv_model(rig.camera(i).model)) chosen.push_back(static_cast<int>(i));
  }
  return rig.subset(chosen);
}

void expect_equal(const camera::Rig& a, const camera::Rig& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const camera::Camera &ca = a.camera(i), &cb = b.camera(i);
    const camera::Intrinsics &ka = camera::intrinsics(ca.model), &kb = camera::intrinsics(cb.model);
    EXPECT_EQ(camera::model_name(ca.model), camera::model_name(cb.model));
    EXPECT_EQ((std::array{ka.fx, ka.fy, ka.cx, ka.cy}), (std::array{kb.fx, kb.fy, kb.cx, kb.cy}));
    EXPECT_EQ(camera::distortion(ca.model), camera::distortion(cb.model));
    EXPECT_EQ((std::array{ca.width, ca.height}), (std::array{cb.width, cb.height}));
    EXPECT_EQ(ca.time_offset_ns, cb.time_offset_ns);
    EXPECT_EQ(ca.mask_file, cb.mask_file);
    EXPECT_EQ(ca.readout_s, cb.readout_s);
    EXPECT_EQ(a.body_from_cam(i).translation(), b.body_from_cam(i).translation());
    EXPECT_LT((a.body_from_cam(i).matrix() - b.body_from_cam(i).matrix()).cwiseAbs().maxCoeff(), 2e-14);
  }
}

// The rig file of one camera, with lines replaced.
class OwnRigFile : public testing::Test {
 protected:
  Result<camera::Rig> read(const std::string& text) {
    support::write_text(folder_.path() / "rig.yaml", text);
    return read_rig(folder_.path() / "rig.yaml");
  }
  Result<camera::Rig> read_with(const std::string& from, const std::string& to) {
    std::string text = kGood;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return read(text.replace(at, from.size(), to));
  }

  static constexpr const char* kGood =
      "bslam_rig: 1\n"
      "cameras:\n"
      "  - name: left\n"
      "    model: pinhole-radtan\n"
      "    resolution: [752, 480]\n"
      "    intrinsics: [458.654, 457.296, 367.215, 248.375]\n"
      "    distortion: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"
      "    T_body_cam: [[0, -1, 0, 0.5], [1, 0, 0, -0.25], [0, 0, 1, 0.125], [0, 0, 0, 1]]\n"
      "    time_offset_s: -0.0015\n"
      "    mask: masks/left.png\n";
  support::TemporaryFolder folder_;
};

TEST_F(OwnRigFile, IsRead) {
  const auto rig = read(kGood);
  ASSERT_TRUE(rig) << rig.error().message();
  ASSERT_EQ(rig->size(), 1u);
  const camera::Camera& camera = rig->camera(std::size_t{0});
  EXPECT_EQ(camera.name, "left");
  EXPECT_EQ(camera.width, 752);
  EXPECT_EQ(camera.time_offset_ns, -1'500'000);
  EXPECT_EQ(camera.mask_file, (folder_.path() / "masks" / "left.png").string());
  EXPECT_LT((rig->body_from_cam(0) * geometry::Vector3d(1, 0, 0) - geometry::Vector3d(0.5, 0.75, 0.125)).norm(), 1e-12);
}

constexpr const char* kMatrix = "T_body_cam: [[0, -1, 0, 0.5], [1, 0, 0, -0.25], [0, 0, 1, 0.125], [0, 0, 0, 1]]\n";

TEST_F(OwnRigFile, TakesAPositionWithAQuaternion) {
  const auto matrix = read(kGood);
  const auto rig = read_with(
      kMatrix, "position: [0.5, -0.25, 0.125]\n    quaternion_xyzw: [0, 0, 0.7071067811865476, 0.7071067811865476]\n");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_LT((rig->body_from_cam(0).matrix() - matrix->body_from_cam(0).matrix()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_F(OwnRigFile, TakesAPositionWithYawPitchAndRoll) {
  struct Mount {
    const char* angles;
    Eigen::Vector3d right, forward;  // of the image, in the body frame: x forward, y left, z up
  };
  const double h = std::sqrt(0.5);
  for (const Mount& m : {Mount{"[0, 0, 0]", {0, -1, 0}, {1, 0, 0}}, Mount{"[90, 0, 0]", {1, 0, 0}, {0, 1, 0}},
                         Mount{"[0, 45, 0]", {0, -1, 0}, {h, 0, -h}}, Mount{"[0, 0, 180]", {0, 1, 0}, {1, 0, 0}},
                         Mount{"[0, 0, 90]", {0, 0, -1}, {1, 0, 0}}}) {
    const auto rig = read_with(kMatrix, std::string("position: [1, 2, 3]\n    yaw_pitch_roll_deg: ") + m.angles + "\n");
    ASSERT_TRUE(rig) << rig.error().message();
    const Eigen::Matrix3d R = rig->body_from_cam(0).matrix3();
    EXPECT_LT((R.col(0) - m.right).norm(), 1e-12) << m.angles;
    EXPECT_LT((R.col(2) - m.forward).norm(), 1e-12) << m.angles;
    EXPECT_EQ(rig->body_from_cam(0).translation(), Eigen::Vector3d(1, 2, 3));
  }
}

TEST_F(OwnRigFile, TakesExactlyOneFormOfThePose) {
  const auto key_of = [&](const std::string& pose) {
    const auto rig = read_with(kMatrix, pose);
    EXPECT_FALSE(rig) << pose;
    return rig ? std::string() : rig.error().key;
  };
  const std::string position = "position: [1, 2, 3]\n    ", quaternion = "quaternion_xyzw: [0, 0, 0, 1]\n    ";
  EXPECT_EQ(key_of(std::string(kMatrix) + "    position: [1, 2, 3]\n"), "cameras[0].T_body_cam");
  EXPECT_EQ(key_of(position + "\n"), "cameras[0].position");
  EXPECT_EQ(key_of(quaternion + "\n"), "cameras[0].position");
  EXPECT_EQ(key_of(position + quaternion + "yaw_pitch_roll_deg: [0, 0, 0]\n"), "cameras[0].quaternion_xyzw");
  EXPECT_EQ(key_of(position + "quaternion_xyzw: [0, 0, 0, 2]\n"), "cameras[0].quaternion_xyzw");
  EXPECT_EQ(key_of(position + "yaw_pitch_roll_deg: [0, 0]\n"), "cameras[0].yaw_pitch_roll_deg");
  EXPECT_EQ(key_of("\n"), "cameras[0].T_body_cam");
}

TEST_F(OwnRigFile, AreJoinedByTheirBodyFrame) {
  const fs::path a = folder_.path() / "a.yaml", b = folder_.path() / "b.yaml";
  const camera::Rig rig = mixed_rig();
  ASSERT_TRUE(write_rig(rig.subset(std::vector<int>{0, 1}), a));
  ASSERT_TRUE(write_rig(rig.subset(std::vector<int>{1, 2}), b));
  const auto joined = read_joined_rigs(std::array{a, b});
  ASSERT_TRUE(joined) << joined.error().message();
  ASSERT_EQ(joined->rig.size(), 4u);
  EXPECT_EQ(joined->rig.camera(std::size_t{1}).name, rig.camera(std::size_t{1}).name);
  EXPECT_EQ(joined->rig.camera(std::size_t{2}).name, "cam2");  // its name is taken
  for (std::size_t i = 0; i < 4; ++i) {
    const geometry::SE3& expected = rig.body_from_cam(std::array<std::size_t, 4>{0, 1, 1, 2}[i]);
    EXPECT_LT((joined->rig.body_from_cam(i).matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-12);
  }
  ASSERT_TRUE(write_rig(without(rig, Droppable::kBodyFrame), b));  // relative to its camera 0 only
  const auto refused = read_joined_rigs(std::array{a, b});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().file, b.string());
  EXPECT_TRUE(read_joined_rigs(std::array{b}));
}

TEST_F(OwnRigFile, KeepsRollingShutters) {
  const auto rig = read_with("time_offset_s: -0.0015\n", "rolling_shutter_readout_s: 0.0185\n");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->camera(std::size_t{0}).readout_s, 0.0185);
  const auto again = read(rig_to_yaml(*rig));
  ASSERT_TRUE(again) << again.error().message();
  expect_equal(*rig, *again);
  EXPECT_EQ(without(*rig, Droppable::kRollingShutters).camera(std::size_t{0}).readout_s, 0);
  const auto wrong = read_with("time_offset_s: -0.0015\n", "rolling_shutter_readout_s: 20\n");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().key, "cameras[0].rolling_shutter_readout_s");
}

TEST_F(OwnRigFile, KeepsTheRigFrameOfARefinedCalibration) {
  const auto rig = read(kGood);
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig_to_yaml(*rig).find("T_cam0_rig"), std::string::npos);
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig->size(); ++c) cameras.push_back({rig->camera(c), rig->body_from_cam(c)});
  const geometry::SE3 T_cam0_rig(geometry::so3_exp({0.01, -0.02, 0}), Eigen::Vector3d::Zero());
  const std::string text = rig_to_yaml(camera::Rig(cameras, T_cam0_rig));
  const auto again = read(text);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_TRUE(again->cam_from_rig(0).matrix().isApprox(T_cam0_rig.matrix(), 1e-12));
  EXPECT_TRUE(again->body_from_rig().matrix().isApprox((rig->body_from_cam(0) * T_cam0_rig).matrix(), 1e-12));
  std::string moved = text;
  moved.replace(moved.find(", 0.0]"), 6, ", 0.1]");
  EXPECT_EQ(read(moved).error().key, "T_cam0_rig");
}

TEST_F(OwnRigFile, MayOmitKeysWithDefaults) {
  const auto rig = read(
      "bslam_rig: 1\ncameras:\n  - {model: pinhole, resolution: [4, 3], intrinsics: [1, 1, 2, 2],\n"
      "     T_body_cam: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], mask: null}\n");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->camera(std::size_t{0}).name, "cam0");
  EXPECT_EQ(rig->camera(std::size_t{0}).mask_file, "");
}

TEST_F(OwnRigFile, RenormalisesARoundedRotation) {
  const auto rig = read_with("[0, -1, 0, 0.5]", "[0.0003, -1.0002, 0, 0.5]");
  ASSERT_TRUE(rig) << rig.error().message();
  const geometry::Matrix3d R = rig->body_from_cam(0).matrix3();
  EXPECT_LT((R.transpose() * R - geometry::Matrix3d::Identity()).norm(), 1e-14);
}

TEST_F(OwnRigFile, ErrorsNameTheKeyAndValue) {
  struct Case {
    const char *from, *to, *key, *found;
  };
  for (const Case& c : {
           Case{"[458.654, 457.296", "[-458.654, 457.296", "cameras[0].intrinsics", "focal length -458.654"},
           Case{"[458.654, 457.296", "[0, 457.296", "cameras[0].intrinsics", "focal length 0"},
           Case{"[458.654, 457.296", "[.nan, 457.296", "cameras[0].intrinsics[0]", ".nan"},
           Case{"367.215", ".inf", "cameras[0].intrinsics[2]", ".inf"},
           Case{"[458.654, ", "[", "cameras[0].intrinsics", "3 numbers"},
           Case{"[458.654, 457.296, 367.215, 248.375]", "458", "cameras[0].intrinsics", "458"},
           Case{"pinhole-radtan", "telepathic", "cameras[0].model", "telepathic"},
           Case{", 1.76187114e-05]", "]", "cameras[0].distortion", "3 numbers"},
           Case{"pinhole-radtan", "pinhole", "cameras[0].distortion", "4 numbers"},
           Case{"-0.28340811", "wide", "cameras[0].distortion[0]", "wide"},
           Case{"-0.28340811", "-1e9", "cameras[0].distortion", "coefficients for which the model projects no point"},
           Case{"[752, 480]", "[752, 0]", "cameras[0].resolution", "0"},
           Case{"[752, 480]", "[30000, 480]", "cameras[0].resolution", "30000"},
           Case{"[752, 480]", "[752.5, 480]", "cameras[0].resolution", "752.5"},
           Case{"[752, 480]", "[752]", "cameras[0].resolution", "1 numbers"},
           Case{"[0, -1, 0, 0.5]", "[0, -2, 0, 0.5]", "cameras[0].T_body_cam",
                "a 3x3 part that is not a rotation (R'R differs from I by 3)"},
           Case{"[0, -1, 0, 0.5]", "[0, 1, 0, 0.5]", "cameras[0].T_body_cam", "a mirrored frame (determinant -1)"},
           Case{"[0, 0, 0, 1]]", "[0, 0, 0.1, 1]]", "cameras[0].T_body_cam", "last row 0 0 0.1 1"},
           Case{", [0, 0, 0, 1]]", "]", "cameras[0].T_body_cam", "a list of 3"},
           Case{"[0, 0, 0, 1]]", "[0, 0, 1]]", "cameras[0].T_body_cam[3]", "a list of 3"},
           Case{"    resolution: [752, 480]\n", "", "cameras[0].resolution", "nothing"},
           Case{"    model: pinhole-radtan\n", "", "cameras[0].model", "nothing"},
           Case{"time_offset_s: -0.0015", "time_offset_s: soon", "cameras[0].time_offset_s", "soon"},
           Case{"time_offset_s: -0.0015", "time_offset_s: 1e9", "cameras[0].time_offset_s", "1000000000"},
           Case{"time_offset_s", "time_ofset_s", "cameras[0].time_ofset_s", "an unknown key"},
           Case{"T_body_cam", "T_cam_body", "cameras[0].T_cam_body", "the transform from body to camera"},
           Case{"    mask:", "    name: again\n    mask:", "cameras[0].name", "a repeated key"},
           Case{"bslam_rig: 1", "bslam_rig: 2", "bslam_rig", "2"},
           Case{"bslam_rig: 1", "bslam_rig: one", "bslam_rig", "one"},
           Case{"bslam_rig: 1", "bslam_rig: 1\nrate: 5", "rate", "an unknown key"},
       }) {
    const auto rig = read_with(c.from, c.to);
    ASSERT_FALSE(rig) << c.to;
    EXPECT_EQ(rig.error().file, (folder_.path() / "rig.yaml").string());
    EXPECT_EQ(rig.error().key, c.key) << c.to;
    EXPECT_EQ(rig.error().found, c.found) << c.to;
    const bool unknown_key = rig.error().found == "an unknown key";  // has a sentence instead
    EXPECT_FALSE((unknown_key ? rig.error().sentence : rig.error().expected).empty()) << c.to;
  }
}

TEST_F(OwnRigFile, ErrorsSuggestKeysAndModels) {
  EXPECT_EQ(read_with("time_offset_s", "time_ofset_s").error().sentence, "unknown key; did you mean 'time_offset_s'?");
  EXPECT_EQ(read_with("pinhole-radtan", "telepathic").error().expected,
            "one of: pinhole, pinhole-radtan, kannala-brandt, ucm, eucm, double-sphere, fov");
}

TEST_F(OwnRigFile, RejectsMissingCamerasAndRepeatedNames) {
  EXPECT_EQ(read("bslam_rig: 1\n").error().key, "cameras");
  EXPECT_EQ(read("bslam_rig: 1\ncameras: []\n").error().key, "cameras");
  const std::string two = std::string(kGood) + std::string(kGood).substr(std::string(kGood).find("  - name"));
  EXPECT_EQ(read(two).error().key, "cameras[1].name");
}

TEST_F(OwnRigFile, SyntaxErrorsNameTheLine) {
  EXPECT_EQ(read("bslam_rig: 1\ncameras:\n  - [1, 2\n b}").error().key, "line 4");
  EXPECT_EQ(read("a: [1, 2\n b}").error().key, "line 2");
}

TEST_F(OwnRigFile, RejectsUnknownFormats) {
  EXPECT_EQ(read("something: else\n").error().found, "a file of unknown format");
  EXPECT_FALSE(read(""));
  EXPECT_FALSE(read_rig(folder_.path() / "none.yaml"));
  const Result<camera::Rig> map = read("BSLAMMAP\x05 and so on");
  EXPECT_EQ(map.error().found, "a saved map");
  EXPECT_EQ(map.error().expected, "a calibration; bslam rig info FILE shows the cameras of a map");
  fs::create_directories(folder_.path() / "empty");
  EXPECT_EQ(read_rig(folder_.path() / "empty").error().found, "a folder without a calibration");
}

TEST_F(OwnRigFile, RejectsRecordingsByTheirContent) {
  for (const std::string begin : {"#ROSBAG V2.0\n", "\x89MCAP0\r\n", "SQLite format 3"}) {
    const Result<camera::Rig> file = read(begin + std::string(5 << 20, '\t'));
    EXPECT_EQ(file.error().found, "a recording");
    fs::create_directories(folder_.path() / "walk");
    fs::rename(folder_.path() / "rig.yaml", folder_.path() / "walk" / "walk_0.db3");
    const auto folder = read_rig(folder_.path() / "walk");
    EXPECT_EQ(folder.error().message(), (folder_.path() / "walk").string() +
                                            ": found a recording, expected a calibration; bslam rig convert RECORDING "
                                            "rig.yaml writes that of its CameraInfo to a file");
  }
}

TEST_F(OwnRigFile, RoundTripsExactly) {
  const camera::Rig rig = mixed_rig();
  ASSERT_TRUE(write_rig(rig, folder_.path() / "rig.yaml"));
  const auto again = read_rig(folder_.path() / "rig.yaml");
  ASSERT_TRUE(again) << again.error().message();
  expect_equal(rig, *again);
  for (std::size_t i = 0; i < rig.size(); ++i) EXPECT_EQ(again->camera(i).name, rig.camera(i).name);
}

TEST_F(OwnRigFile, StoresOffsetsAndMasks) {
  std::vector<camera::RigCamera> cameras;
  for (const TimeNs offset : {TimeNs{0}, TimeNs{1}, TimeNs{-1}, TimeNs{1234567891}, TimeNs{-999999999999}}) {
    camera::Camera camera = camera::test_cameras()[0];
    camera.name = "a \"name\": # " + std::to_string(offset);
    camera.time_offset_ns = offset;
    camera.mask_file = (folder_.path() / "mask with space.png").string();
    cameras.push_back({camera, geometry::SE3()});
  }
  const camera::Rig rig(cameras);
  ASSERT_TRUE(write_rig(rig, folder_.path() / "rig.yaml"));
  const auto again = read_rig(folder_.path() / "rig.yaml");
  ASSERT_TRUE(again) << again.error().message();
  expect_equal(rig, *again);
  EXPECT_EQ(again->camera(std::size_t{1}).name, rig.camera(std::size_t{1}).name);
}

// ---- EuRoC

class EurocSensor : public OwnRigFile {
 protected:
  Result<camera::Rig> sensor_with(const std::string& from, const std::string& to) {
    std::string text = support::small_sensor_yaml(0.1);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return read(text.replace(at, from.size(), to));
  }
};

TEST_F(EurocSensor, SupportsAllDistortionModels) {
  EXPECT_EQ(camera::model_name(sensor_with("intr", "intr").value().camera(std::size_t{0}).model), "pinhole-radtan");
  const auto kb = sensor_with("radial-tangential", "equidistant");
  EXPECT_EQ(camera::model_name(kb.value().camera(std::size_t{0}).model), "kannala-brandt");
  EXPECT_EQ(camera::model_name(sensor_with("radial-tangential", "none").value().camera(std::size_t{0}).model),
            "pinhole");
  EXPECT_EQ(camera::model_name(sensor_with("radial-tangential", "radtan").value().camera(std::size_t{0}).model),
            "pinhole-radtan");
  for (const char* coefficients : {"[.1, 0, 0, 0, 0]", "[.1, 0, 0, 0, 0, .1, 0, 0]"}) {
    EXPECT_TRUE(sensor_with("[0, 0, 0, 0]", coefficients));
  }
}

TEST_F(EurocSensor, ErrorsNameTheKeyAndValue) {
  struct Case {
    const char *from, *to, *key;
  };
  for (const Case& c :
       {Case{"[20, 20,", "[-20, 20,", "intrinsics"}, Case{"[20, 20,", "[.nan, 20,", "intrinsics[0]"},
        Case{"[20, 20,", "[20,", "intrinsics"}, Case{"radial-tangential", "telepathic", "distortion_model"},
        Case{"camera_model: pinhole", "camera_model: omni", "camera_model"},
        Case{"[0, 0, 0, 0]", "[0, 0, 0]", "distortion_coefficients"},
        Case{"[1, 0, 0, 0.1", "[2, 0, 0, 0.1", "T_BS.data"}, Case{"[1, 0, 0, 0.1", "[-1, 0, 0, 0.1", "T_BS.data"},
        Case{"[1, 0, 0, 0.1", "[1, 0, 0.1", "T_BS.data"}, Case{"T_BS:", "T_SB:", "T_BS"},
        Case{"resolution", "size", "resolution"}, Case{"[32, 24]", "[32, -24]", "resolution"}}) {
    const auto rig = sensor_with(c.from, c.to);
    ASSERT_FALSE(rig) << c.to;
    EXPECT_EQ(rig.error().key, c.key) << rig.error().message();
  }
  EXPECT_EQ(sensor_with("[1, 0, 0, 0.1", "[-1, 0, 0, 0.1").error().found, "a mirrored frame (determinant -1)");
  EXPECT_EQ(sensor_with("radial-tangential", "telepathic").error().expected,
            "one of: none, radial-tangential, equidistant");
}

TEST_F(EurocSensor, RoundTripsExactly) {
  const camera::Rig rig = euroc_rig();
  ASSERT_TRUE(write_euroc_sensors(rig, folder_.path() / "out", 20.0));
  const auto again = read_rig(folder_.path() / "out");
  ASSERT_TRUE(again) << again.error().message();
  expect_equal(rig, *again);
}

TEST_F(EurocSensor, CannotStoreATimeOffset) {
  camera::Camera camera = camera::test_cameras()[0];
  camera.time_offset_ns = 1;
  EXPECT_FALSE(write_euroc_sensors(camera::Rig({{camera, geometry::SE3()}}), folder_.path(), 20.0));
}

TEST_F(EurocSensor, CannotStoreASphereModel) {
  const Status status = write_euroc_sensors(mixed_rig(), folder_.path(), 20.0);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().found, "model double-sphere, which EuRoC sensor files cannot store");
}

// ---- KITTI

constexpr const char* kCalib =
    "P0: 700 0 600 0 0 710 180 0 0 0 1 0\n"
    "P1: 700 0 600 -350 0 710 180 0 0 0 1 0\n"
    "P2: 700 0 600 45.38 0 710 180 -0.1130887 0 0 1 0.003779761\n"
    "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n";

TEST_F(OwnRigFile, KittiCalibrationGivesPosesFromProjections) {
  support::write_text(folder_.path() / "calib.txt", kCalib);
  for (const int c : {0, 1, 2})
    support::write_image(folder_.path() / ("image_" + std::to_string(c)) / "000000.png", 124, 37);
  for (const fs::path& path : {folder_.path(), folder_.path() / "calib.txt"}) {
    const auto rig = read_rig(path);
    ASSERT_TRUE(rig) << rig.error().message();
    ASSERT_EQ(rig->size(), 3u);
    EXPECT_EQ(rig->camera(std::size_t{1}).name, "image_1");
    EXPECT_EQ(rig->camera(std::size_t{1}).width, 124);
    EXPECT_LT((rig->body_from_cam(1).translation() - geometry::Vector3d(0.5, 0, 0)).norm(), 1e-12);
    // P = K [I | t]: a point of camera 0 projects to the same pixel through P2 and through the camera at its pose.
    const geometry::Vector3d p(0.3, -0.2, 4.0);
    const geometry::Vector3d h(700 * p.x() + 600 * p.z() + 45.38, 710 * p.y() + 180 * p.z() - 0.1130887,
                               p.z() + 0.003779761);
    const auto pixel = rig->camera(std::size_t{2}).project(rig->cam_from_rig(std::size_t{2}) * p);
    EXPECT_LT((pixel.value() - h.head<2>() / h.z()).norm(), 1e-9);
  }
}

TEST_F(OwnRigFile, KittiCalibrationIsValidated) {
  support::write_image(folder_.path() / "image_0" / "000000.png", 124, 37);
  const auto broken = [&](const std::string& text) {
    support::write_text(folder_.path() / "calib.txt", text);
    return read_rig(folder_.path()).error();
  };
  EXPECT_EQ(broken("P0: 700 0 600 0 0 710 180 0 0 0 1\n").found, "11 numbers");
  EXPECT_EQ(broken("P0: 700 0 600 0 0 ten 180 0 0 0 1 0\n").found, "ten");
  EXPECT_EQ(broken("P0: -700 0 600 0 0 710 180 0 0 0 1 0\n").expected, "positive focal lengths");
  EXPECT_EQ(broken("P0: 700 1 600 0 0 710 180 0 0 0 1 0\n").key, "P0");
  EXPECT_EQ(broken("P0: 700 0 600 0 0 710 180 0 0 0 1 0\nP0: 700 0 600 0 0 710 180 0 0 0 1 0\n").found,
            "a repeated line");
  EXPECT_EQ(broken("nothing\n").found, "no projection");
  EXPECT_EQ(broken("P3: 700 0 600 0 0 710 180 0 0 0 1 0\n").found, "no images in its folder");
}

}  // namespace
}  // namespace bslam::rig_formats
