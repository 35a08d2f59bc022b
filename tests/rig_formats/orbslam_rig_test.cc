// Calibrations of ORB-SLAM3.
#include <gtest/gtest.h>

#include "camera/test_cameras.h"
#include "rig_formats/rig_formats.h"

namespace bslam::rig_formats {
namespace {

constexpr const char* kOrbslam = R"(%YAML:1.0
File.version: "1.0"
Camera.type: "KannalaBrandt8"
Camera1.fx: 190.97847715128717
Camera1.fy: 190.9733070521226
Camera1.cx: 254.93170605935475
Camera1.cy: 256.8974428996504
Camera1.k1: 0.0034823894022493434
Camera1.k2: 0.0007150348452162257
Camera1.k3: -0.0020532361418706202
Camera1.k4: 0.00020293673591811182
Camera2.fx: 190.44236969414825
Camera2.fy: 190.4344384721956
Camera2.cx: 252.59949716835982
Camera2.cy: 254.91723064636983
Camera2.k1: 0.0034003170790442797
Camera2.k2: 0.001766278153469831
Camera2.k3: -0.00266312569781606
Camera2.k4: 0.0003299517423931039
Stereo.T_c1_c2: !!opencv-matrix
  rows: 4
  cols: 4
  dt: f
  data: [ 0.999999445773493,   0.000791687752817,   0.000694034010224,   0.101063427414194,
         -0.000823363992158,   0.998899461915674,   0.046895490788700,   0.001946204678584,
         -0.000656143613644,  -0.046896036240590,   0.998899560146304,   0.001015350132563,
         0.0,0.0,0.0,1.0]
Camera.width: 512
Camera.height: 512
)";

TEST_F(RigFormats, OrbslamFisheyesHaveTheirOwnCoefficients) {
  const auto file = read(kOrbslam);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kOrbslam3);
  ASSERT_EQ(file->rig.size(), 2u);
  EXPECT_EQ(camera::distortion(file->rig.camera(index(1)).model)[0], 0.0034003170790442797);
  EXPECT_LT(
      (file->rig.rig_from_cam(1).translation() - Vector3d(0.101063427414194, 0.001946204678584, 0.001015350132563))
          .norm(),
      1e-12);
  EXPECT_EQ(file->notes.size(), 2u);  // on the body frame, and on the coefficients
}

TEST_F(RigFormats, OrbslamRectifiedPairIsSeparatedByTheBaseline) {
  const std::string common = "%YAML:1.0\nCamera.width: 752\nCamera.height: 480\n";
  const auto stereo = read(common +
                           "Camera.type: \"Rectified\"\nCamera1.fx: 435.2\nCamera1.fy: 435.2\nCamera1.cx: 367.4\n"
                           "Camera1.cy: 252.2\nStereo.b: 0.1100785\n");
  ASSERT_TRUE(stereo) << stereo.error().message();
  EXPECT_EQ(stereo->rig.rig_from_cam(1).translation(), Vector3d(0.1100785, 0, 0));
  const std::string old = common + "Camera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.4\nCamera.cy: 252.2\n";
  const auto by_bf = read(old + "Camera.bf: 47.90639\n");
  ASSERT_TRUE(by_bf) << by_bf.error().message();
  EXPECT_NEAR(by_bf->rig.rig_from_cam(1).translation().x(), 47.90639 / 435.2, 1e-15);
  EXPECT_EQ(read(old)->rig.size(), 1u);
  EXPECT_EQ(read(old + "Camera.bf: 40.0\nDepthMapFactor: 5000.0\n")->rig.size(), 1u);  // RGB-D
  EXPECT_EQ(read(old + "Camera.bf: -40.0\n").error().key, "Camera.bf");
}

// ORB-SLAM2's EuRoC.yaml: the extrinsics of the raw cameras, recovered from their rectification, equal EuRoC's.
TEST_F(RigFormats, OrbslamRectificationGivesTheRawCameras) {
  const auto matrix = [](const std::string& key, int rows, int cols, const std::string& data) {
    return key + ": !!opencv-matrix\n   rows: " + std::to_string(rows) + "\n   cols: " + std::to_string(cols) +
           "\n   dt: d\n   data:[" + data + "]\n";
  };
  const auto file = read(
      "%YAML:1.0\nCamera.fx: 435.2046959714599\nCamera.fy: 435.2046959714599\nCamera.cx: 367.4517211914062\n"
      "Camera.cy: 252.2008514404297\nCamera.width: 752\nCamera.height: 480\nCamera.bf: 47.90639384423901\n" +
      matrix("LEFT.D", 1, 5, "-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0") +
      matrix("LEFT.K", 3, 3, "458.654, 0.0, 367.215, 0.0, 457.296, 248.375, 0.0, 0.0, 1.0") +
      matrix("LEFT.R", 3, 3,
             "0.999966347530033, -0.001422739138722922, 0.008079580483432283, 0.001365741834644127, "
             "0.9999741760894847, 0.007055629199258132, -0.008089410156878961, -0.007044357138835809, "
             "0.9999424675829176") +
      matrix("RIGHT.D", 1, 5, "-0.28368365, 0.07451284, -0.00010473, -3.555907e-05, 0.0") +
      matrix("RIGHT.K", 3, 3, "457.587, 0.0, 379.999, 0.0, 456.134, 255.238, 0.0, 0.0, 1") +
      matrix(
          "RIGHT.R", 3, 3,
          "0.9999633526194376, -0.003625811871560086, 0.007755443660172947, 0.003680398547259526, "
          "0.9999684752771629, -0.007035845251224894, -0.007729688520722713, 0.007064130529506649, 0.999945173484644"));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(camera::intrinsics(file->rig.camera(index(1)).model).fx, 457.587);
  const auto sensor = [](const char* T, const char* intrinsics) {
    return std::string("camera_model: pinhole\nT_BS:\n  data: [") + T + ", 0, 0, 0, 1]\nresolution: [752, 480]\n" +
           "intrinsics: [" + intrinsics + "]\ndistortion_model: none\n";
  };
  const auto left = read(sensor("0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008, "
                                "0.0149672133247, 0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797, "
                                "0.999660727178, 0.00981073058949",
                                "458, 457, 367, 248"),
                         "left.yaml");
  const auto right =
      read(sensor("0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556, 0.999598781151, "
                  "0.0130119051815, 0.0251588363115, 0.0453689425024, -0.0253898008918, 0.0179005838253, "
                  "0.999517347078, 0.00786212447038",
                  "458, 457, 367, 248"),
           "right.yaml");
  const SE3 T_left_right = left->rig.body_from_cam(0).inverse() * right->rig.body_from_cam(0);
  EXPECT_LT((file->rig.rig_from_cam(1).matrix() - T_left_right.matrix()).cwiseAbs().maxCoeff(), 2e-5);
}

TEST_F(RigFormats, OrbslamRejectsInvalidValues) {
  struct Case {
    const char *from, *to, *key;
  };
  for (const Case& c :
       {Case{"KannalaBrandt8", "Telepathic", "Camera.type"}, Case{"Camera1.k3: -0.002", "Camera1.k9: 0", "Camera1.k3"},
        Case{"Camera.width: 512", "Camera.width: wide", "Camera.width"},
        Case{"Camera.height: 512", "", "Camera.height"}, Case{"Stereo.T_c1_c2", "Stereo.T_c2_c1", "Stereo.T_c1_c2"},
        Case{"0.999999445773493", "1.2", "Stereo.T_c1_c2.data"},
        Case{"Camera2.fy: 190", "Camera2.fz: 190", "Camera2.fy"},
        Case{"Camera2.fx: 190", "Camera1.fx: 190", "Camera1.fx"}}) {
    const auto file = read_with(kOrbslam, c.from, c.to);
    ASSERT_FALSE(file) << c.to;
    EXPECT_EQ(file.error().key, c.key) << file.error().message();
  }
}

TEST_F(RigFormats, OrbslamPinholesHaveCoefficientsBothOrNeither) {
  std::string pinholes(kOrbslam);
  pinholes.replace(pinholes.find("KannalaBrandt8"), std::string_view("KannalaBrandt8").size(), "PinHole");
  for (const char* camera : {"Camera1.", "Camera2."}) {
    for (const auto& [from, to] : {std::pair{"k3: -0", "p1: 0"}, std::pair{"k4: 0", "p2: 0"}}) {
      const std::string key = std::string(camera) + from;
      pinholes.replace(pinholes.find(key), key.size(), std::string(camera) + to);
    }
  }
  ASSERT_TRUE(read(pinholes)) << read(pinholes).error().message();
  for (const std::string key : {"Camera1.k1", "Camera2.k1"}) {
    std::string without = pinholes;
    without.erase(without.find(key), without.find('\n', without.find(key)) + 1 - without.find(key));
    const auto file = read(without);
    ASSERT_FALSE(file) << key;
    EXPECT_EQ(file.error().key, key) << file.error().message();
  }
}

TEST_F(RigFormats, OrbslamStoresUpToTwoCamerasOfOneKind) {
  const auto cameras = camera::test_cameras();
  const auto write = [&](const std::vector<camera::RigCamera>& rig) {
    return write_rig_as(camera::Rig(rig), RigFormat::kOrbslam3, folder_.path() / "out.yaml");
  };
  EXPECT_TRUE(write({{cameras[1], SE3()}}));
  EXPECT_EQ(write({{cameras[1], SE3()}, {cameras[1], SE3()}, {cameras[1], SE3()}}).error().found, "3 cameras");
  EXPECT_EQ(write({{cameras[1], SE3()}, {cameras[5], SE3()}}).error().found, "kannala-brandt");
  EXPECT_EQ(write({{cameras[1], SE3()}, {cameras[2], SE3()}}).error().found, "1392x512 pixels");
}

}  // namespace
}  // namespace bslam::rig_formats
