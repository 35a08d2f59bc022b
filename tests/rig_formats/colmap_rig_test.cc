// Reading and writing of COLMAP rigs.
#include "base/atomic_file.h"
#include "camera/test_cameras.h"
#include "rig_formats/rig_formats.h"

namespace bslam::rig_formats {
namespace {

class ColmapRig : public RigFormats {
 protected:
  Result<RigFile> read_folder(const std::string& cameras, const std::string& rigs, const std::string& config) {
    std::error_code error;
    fs::remove_all(folder_.path() / "rig", error);
    support::write_text(folder_.path() / "rig" / "cameras.txt", cameras);
    if (!rigs.empty()) support::write_text(folder_.path() / "rig" / "rigs.txt", rigs);
    if (!config.empty()) support::write_text(folder_.path() / "rig" / "rig_config.json", config);
    return read_rig_file(folder_.path() / "rig");
  }
  static constexpr const char* kCameras =
      "# Camera list\n1 SIMPLE_RADIAL 640 480 500.5 320 240 -0.02\n2 OPENCV_FISHEYE 640 480 300 301 321 239 .1 .01 0 "
      "0\n";
  static constexpr const char* kRigs = "# comment\n7 2 CAMERA 2 CAMERA 1 1 1 0 0 0 -0.2 0.0 0.1\n";
};

TEST_F(ColmapRig, IsReadFromItsTextModel) {
  const auto file = read_folder(kCameras, kRigs, "");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->format, RigFormat::kColmap);
  ASSERT_EQ(file->rig.size(), 2u);
  EXPECT_EQ(file->rig.camera(index(0)).name, "camera_2");  // the reference sensor
  EXPECT_EQ(camera::model_name(file->rig.camera(index(0)).model), "kannala-brandt");
  const camera::Camera& radial = file->rig.camera(index(1));
  EXPECT_EQ(camera::distortion(radial.model), (std::vector{-0.02, 0.0, 0.0, 0.0}));
  // sensor_from_rig: the rig's origin is at (-0.2, 0, 0.1) in the sensor frame.
  EXPECT_LT((file->rig.rig_from_cam(1).translation() - Vector3d(0.2, 0, -0.1)).norm(), 1e-12);
  // The centre of the image, 320 of 640 in COLMAP, is between two pixels in bslam.
  EXPECT_LT((radial.project({0, 0, 1}).value() - Vector2d(319.5, 239.5)).norm(), 1e-12);
  for (const char* name : {"cameras.txt", "rigs.txt"}) {
    EXPECT_EQ(read_rig_file(folder_.path() / "rig" / name)->rig.size(), 2u) << name;
  }
}

TEST_F(ColmapRig, HoldsTheFieldOfViewModel) {
  const auto file = read_folder("1 FOV 640 480 300 301 320 240 0.9\n", "", "");
  ASSERT_TRUE(file) << file.error().message();
  const camera::Camera& camera = file->rig.camera(index(0));
  EXPECT_EQ(camera::model_name(camera.model), "fov");
  EXPECT_EQ(camera::distortion(camera.model), std::vector{0.9});
  EXPECT_EQ(camera::intrinsics(camera.model).cx, 319.5);
  ASSERT_TRUE(write_rig_as(file->rig, RigFormat::kColmap, folder_.path() / "out"));
  const std::string written = read_file(folder_.path() / "out" / "cameras.txt", 4096).value();
  EXPECT_NE(written.find("1 FOV 640 480 300.0 301.0 320.0 240.0 0.9\n"), std::string::npos) << written;
  EXPECT_EQ(read_folder("1 FOV 640 480 300 301 320 240\n", "", "").error().expected, "5 for FOV");
  EXPECT_EQ(read_folder("1 FOV 640 480 300 301 320 240 4\n", "", "").error().expected, "w in [1e-06, 3.14]");
}

TEST_F(ColmapRig, HasTheExtendedUnifiedModelOfExportedMaps) {
  const auto file = read_folder("1 EUCM 752 480 300 301 376 240 0.5 1.1\n", "", "");
  ASSERT_TRUE(file) << file.error().message();
  const camera::Camera& camera = file->rig.camera(index(0));
  EXPECT_EQ(camera::model_name(camera.model), "eucm");
  EXPECT_EQ(camera::distortion(camera.model), (std::vector{0.5, 1.1}));
  EXPECT_EQ(camera::intrinsics(camera.model).cx, 375.5);
}

TEST_F(ColmapRig, IsReadFromItsRigConfiguration) {
  const std::string config = R"([{"cameras": [{"image_prefix": "rig1/left/", "ref_sensor": true},
    {"image_prefix": "rig1/right/", "cam_from_rig_rotation": [0.7071067811865475, 0.0, 0.7071067811865476, 0.0],
     "cam_from_rig_translation": [0, 0, 0.5], "camera_model_name": "PINHOLE", "camera_params": [400, 401, 320, 240]}]}])";
  const auto file = read_folder(kCameras, "", config);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->rig.camera(index(0)).name, "rig1/left");
  EXPECT_EQ(camera::model_name(file->rig.camera(index(1)).model), "pinhole");
  EXPECT_EQ(camera::intrinsics(file->rig.camera(index(1)).model).fy, 401);
  // A rotation by 90 degrees about y: the forward direction of the rig is the right direction of the camera.
  EXPECT_LT((file->rig.cam_from_rig(index(1)).rotation() * Vector3d::UnitZ() - Vector3d::UnitX()).norm(), 1e-12);
  std::string broken = config;
  broken.replace(broken.find("0.7071067811865475"), 18, "0.8");
  EXPECT_EQ(read_folder(kCameras, "", broken).error().key, "rigs[0].cameras[1].cam_from_rig_rotation");
  broken = config;
  broken.replace(broken.find("cam_from_rig_translation"), 24, "rig_from_cam_translation");
  EXPECT_EQ(read_folder(kCameras, "", broken).error().key, "rigs[0].cameras[1].cam_from_rig_translation");
}

TEST_F(ColmapRig, RejectsInvalidFiles) {
  EXPECT_EQ(read_folder("1 THIN_PRISM_FISHEYE 640 480 1 1 1 1\n", "", "").error().found, "THIN_PRISM_FISHEYE");
  EXPECT_EQ(read_folder("1 PINHOLE 640 480 500 320 240\n", "", "").error().found, "3 parameters");
  EXPECT_EQ(read_folder("1 PINHOLE 640 480 500 500 320 x\n", "", "").error().key, "line 1");
  EXPECT_EQ(read_folder(kCameras, "", "").error().found, "2 cameras without extrinsics");
  EXPECT_EQ(read_folder(kCameras, "1 1 CAMERA 1\n2 1 CAMERA 2\n", "").error().found, "2 rigs");
  EXPECT_EQ(read_folder(kCameras, "1 2 CAMERA 1 CAMERA 3 1 1 0 0 0 0 0 0\n", "").error().found, "camera 3");
  EXPECT_EQ(read_folder(kCameras, "1 2 CAMERA 1 CAMERA 2 0\n", "").error().key, "line 1");
  EXPECT_EQ(read_folder("1 PINHOLE 640 480 500 500 320 240\n", "", "")->rig.size(), 1u);
}

TEST_F(ColmapRig, CannotStoreABodyFrame) {
  const camera::Rig rig({{camera::test_cameras()[1], SE3(geometry::Quaterniond::Identity(), {0, 0, 1})}});
  const auto status = write_rig_as(rig, RigFormat::kColmap, folder_.path() / "out");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().expected, "camera 0 as the body, or --drop body");
  EXPECT_TRUE(write_rig_as(without(rig, Droppable::kBodyFrame), RigFormat::kColmap, folder_.path() / "out"));
}

TEST_F(ColmapRig, StoresNamesInTheRigConfiguration) {
  camera::Camera camera = camera::test_cameras()[1];
  camera.name = "front \"left\"";
  ASSERT_TRUE(write_rig_as(camera::Rig({{camera, SE3()}}), RigFormat::kColmap, folder_.path() / "out"));
  EXPECT_EQ(read_rig_file(folder_.path() / "out")->rig.camera(index(0)).name, "front \"left\"");
  fs::remove(folder_.path() / "out" / "rigs.txt");
  EXPECT_EQ(read_rig_file(folder_.path() / "out")->rig.camera(index(0)).name, "front \"left\"");
}

TEST_F(ColmapRig, ReadsNamesByIdAndPosesFromRigsTxt) {
  const std::string config =
      R"([{"cameras": [{"image_prefix": "left/", "ref_sensor": true}, {"image_prefix": "right/"}]}])";
  const auto named = read_folder(kCameras, kRigs, config);
  ASSERT_TRUE(named) << named.error().message();
  EXPECT_EQ(named->rig.camera(index(0)).name, "right");  // camera 2, the reference of rigs.txt
  EXPECT_LT((named->rig.rig_from_cam(1).translation() - Vector3d(0.2, 0, -0.1)).norm(), 1e-12);
  const auto other = read_folder(kCameras, kRigs, R"([{"cameras": [{"image_prefix": "left/"}]}])");
  ASSERT_TRUE(other) << other.error().message();
  EXPECT_EQ(other->rig.camera(index(0)).name, "camera_2");
  const auto broken = read_folder(kCameras, kRigs, "[{\"cameras\": ");
  ASSERT_TRUE(broken) << broken.error().message();
  EXPECT_EQ(broken->rig.camera(index(0)).name, "camera_2");
  EXPECT_NE(broken->notes.back().find("camera names are taken from cameras.txt"), std::string::npos);
  EXPECT_EQ(read_folder(kCameras, "", R"([{"cameras": [{"image_prefix": "left/"}]}])").error().key, "rigs[0].cameras");
}

}  // namespace
}  // namespace bslam::rig_formats
