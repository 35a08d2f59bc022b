// OKVIS2's configuration, read, and written and read again.
#include <array>

#include "base/atomic_file.h"
#include "rig_formats/rig_formats.h"

namespace bslam::rig_formats {
namespace {

class OkvisRig : public RigFormats {
 protected:
  // As OKVIS2 has its files: lists over several lines, comments within them, a value that is no number, and IMU
  // parameters with a T_BS of their own.
  static constexpr const char* kOkvis = R"(%YAML:1.0
cameras:
     - {T_SC:
        [ 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
          0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
          -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
           0.0, 0.0, 0.0, 1.0],
        image_dimension: [752, 480],
        distortion_coefficients: [-0.283, 0.0739, 0.000193, 1.76e-05],
        distortion_type: radialtangential,
        focal_length: [458.5, 457.5],
        principal_point: [367.2, 248.4],
        camera_type: gray, #gray, rgb, gray+depth, rgb+depth
        slam_use: okvis} #none, okvis, okvis-depth, okvis-virtual

     - {T_SC:
        [1.0, 0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0],
        image_dimension: [512, 500],
        distortion_coefficients: [0.0034, 0.0007, -0.002, 0.0002],
        distortion_type: equidistant,
        focal_length: [190.9, 191.9],
        principal_point: [254.9, 256.8],
        camera_type: rgb,
        sigma_pixels: = 0.8, # optional
        slam_use: none}

camera_parameters:
    timestamp_tolerance: 0.005 # [s]
    image_delay: 0.0125 # [s] timestamp_camera_correct = timestamp_camera - image_delay
imu_parameters:
    a_max: 176.0
    T_BS:
        [1.0000, 0.0000, 0.0000, 9.0000,
         0.0000, 1.0000, 0.0000, 0.0000,
         0.0000, 0.0000, 1.0000, 0.0000,
         0.0000, 0.0000, 0.0000, 1.0000]
)";
};

TEST_F(OkvisRig, IsRead) {
  const auto file = read(kOkvis);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kOkvis2);
  ASSERT_EQ(file->rig.size(), 2u);
  const camera::Camera &first = file->rig.camera(index(0)), &second = file->rig.camera(index(1));
  EXPECT_EQ(first.name, "cam0");
  EXPECT_EQ(camera::model_name(first.model), "pinhole-radtan");
  EXPECT_EQ(camera::distortion(first.model), (std::vector{-0.283, 0.0739, 0.000193, 1.76e-05}));
  EXPECT_EQ(camera::model_name(second.model), "kannala-brandt");
  const camera::Intrinsics& k = camera::intrinsics(second.model);
  EXPECT_EQ((std::array{k.fx, k.fy, k.cx, k.cy}), (std::array{190.9, 191.9, 254.9, 256.8}));
  EXPECT_EQ((std::array{second.width, second.height}), (std::array{512, 500}));
  // T_SC maps the camera to the IMU, whose frame is the body: T_BS is not applied.
  EXPECT_EQ(file->rig.body_from_cam(1).translation(), Vector3d(0.1, 0.2, 0.3));
  EXPECT_LT((file->rig.body_from_cam(0).rotation() * Vector3d::UnitX() - Vector3d(0.0149, 0.9996, -0.0258)).norm(),
            1e-3);
  EXPECT_EQ(first.time_offset_ns, -12'500'000);
  EXPECT_EQ(second.time_offset_ns, -12'500'000);
  ASSERT_EQ(file->notes.size(), 1u);
  EXPECT_EQ(file->notes[0], "cam1 is read although OKVIS2 does not use it (slam_use: none)");
}

TEST_F(OkvisRig, IsReadWithEightCoefficientsAndInBlocks) {
  const auto file = read(R"(%YAML:1.0
---
cameras:
  - T_SC: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    camera_type: gray
    distortion_coefficients: [0.302, -0.021, -0.00025, 6.1e-05, 0.0158, 0.575, -0.063, 0.034, 0.0, 0.0]
    distortion_type: plumb_bob8
    focal_length: [269.7, 269.8]
    image_dimension: [640, 480]
    principal_point: [322.6, 228.9]
imageDelay: -0.5
)");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kOkvis2);
  EXPECT_EQ(camera::distortion(file->rig.camera(index(0)).model),
            (std::vector{0.302, -0.021, -0.00025, 6.1e-05, 0.0158, 0.575, -0.063, 0.034}));
  EXPECT_EQ(file->rig.camera(index(0)).time_offset_ns, 500'000'000);
  EXPECT_TRUE(file->notes.empty());
}

TEST_F(OkvisRig, RejectsInvalidValues) {
  struct Case {
    const char *from, *to, *key, *found, *expected;
  };
  for (const Case& c : {
           Case{"cameras:", "cameras: nobody\nold:", "cameras", "nobody", "a list of at least one map"},
           Case{"{T_SC", "{T_CS", "cameras[0].T_SC", "nothing", "a list of numbers"},
           Case{"0.0, 0.0, 0.0, 1.0],", "0.0, 0.0, 1.0],", "cameras[0].T_SC", "15 numbers",
                "16 (rows of a 4x4 transform)"},
           Case{"0.999557249008", "-0.999557249008", "cameras[0].T_SC", "not a rotation", "a rigid transform"},
           Case{"image_dimension: [752, 480]", "image_dimension: [752]", "cameras[0].image_dimension", "1 numbers",
                "width and height"},
           Case{"[752, 480]", "[752.5, 480]", "cameras[0].image_dimension", "752.5", "whole pixels"},
           Case{"distortion_type: equidistant", "distortion_type: equi", "cameras[1].distortion_type", "equi",
                "one of: radialtangential, radialtangential8, equidistant, plumb_bob, plumb_bob8"},
           Case{"distortion_type: radialtangential,", "distortion_type: radialtangential8,",
                "cameras[0].distortion_coefficients", "4 numbers", "8 for radialtangential8: k1 k2 p1 p2 k3 k4 k5 k6"},
           Case{"1.76e-05]", "1.76e-05, 0.1]", "cameras[0].distortion_coefficients", "5 numbers",
                "4 for radialtangential: k1 k2 p1 p2"},
           Case{"0.0739", "many", "cameras[0].distortion_coefficients[1]", "many", "a finite number"},
           Case{"[458.5, 457.5]", "[458.5]", "cameras[0].focal_length", "1 numbers", "two numbers: fx fy"},
           Case{"[458.5, 457.5]", "[458.5, -457.5]", "cameras[0].focal_length", "focal length -457.5",
                "a positive number"},
           Case{"principal_point: [254.9", "centre: [254.9", "cameras[1].principal_point", "nothing",
                "a list of numbers"},
           Case{"image_delay: 0.0125", "image_delay: late", "camera_parameters.image_delay", "late", "a finite number"},
           Case{"image_delay: 0.0125", "image_delay: 2.0e6", "camera_parameters.image_delay", "-2000000",
                "at most 1e6 seconds"},
       }) {
    const auto file = read_with(kOkvis, c.from, c.to);
    ASSERT_FALSE(file) << c.to;
    EXPECT_EQ(file.error().file, (folder_.path() / "rig.yaml").string());
    EXPECT_EQ(file.error().key, c.key) << file.error().message();
    EXPECT_NE(file.error().found.find(c.found), std::string::npos) << file.error().message();
    EXPECT_NE(file.error().expected.find(c.expected), std::string::npos) << file.error().message();
  }
  EXPECT_EQ(read("%YAML:1.0\ncameras:\n  - {T_SC: [1.0\n    image_dimension: 3}\n").error().expected, "YAML");
}

TEST_F(OkvisRig, IsWrittenWithOneDelayAndZerosForAPinhole) {
  const camera::Camera plain{"cam0", camera::Pinhole({400, 401, 320, 240}), 640, 480, 12'500'000, {}};
  camera::Camera five = plain;
  five.name = "cam1";
  five.model = camera::PinholeRadTan({400, 401, 320, 240}, {0.1, 0.01, 0.001, 0.002, 0.003});
  const fs::path out = folder_.path() / "out.yaml";
  ASSERT_TRUE(write_rig_as(camera::Rig({{plain, SE3()}, {five, SE3()}}), RigFormat::kOkvis2, out));
  EXPECT_NE(read_file(out, 4096).value().find("  image_delay: -0.0125\n"), std::string::npos);
  const auto again = read_rig_file(out);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->format, RigFormat::kOkvis2);
  const camera::Camera &first = again->rig.camera(index(0)), &second = again->rig.camera(index(1));
  EXPECT_EQ(camera::distortion(first.model), std::vector<double>(4, 0.0));
  EXPECT_EQ(camera::distortion(second.model), (std::vector{0.1, 0.01, 0.001, 0.002, 0.003, 0.0, 0.0, 0.0}));
  EXPECT_EQ(second.time_offset_ns, 12'500'000);
  camera::Camera sphere = plain;
  sphere.model = camera::Unified({230, 231, 319.5, 239.5}, 0.62);
  const auto refused = write_rig_as(camera::Rig({{sphere, SE3()}}), RigFormat::kOkvis2, out);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().found, "model ucm, which OKVIS2's configuration cannot store");
}

}  // namespace
}  // namespace bslam::rig_formats
