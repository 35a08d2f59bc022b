#include "map_export/colmap_model.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "map_export/exported_map.h"

namespace bslam::map_export {
namespace {

using geometry::SE3;

SE3 read_pose(std::istream& in) {
  Eigen::Quaterniond q;
  Eigen::Vector3d t;
  in >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z();
  return {q, t};
}

std::vector<std::string> data_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with("#")) lines.push_back(line);
  return lines;
}

struct ParsedImage {
  SE3 T_cam_world;
  int camera = 0;
  std::string name;
  std::vector<std::pair<Eigen::Vector2d, int>> points;
};

std::map<int, ParsedImage> parse_images(const std::string& text) {
  std::map<int, ParsedImage> images;
  const std::vector<std::string> lines = data_lines(text);
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
    std::istringstream in(lines[i]), list(lines[i + 1]);
    int id = 0;
    in >> id;
    ParsedImage& image = images[id];
    image.T_cam_world = read_pose(in);
    in >> image.camera >> image.name;
    double x = 0, y = 0;
    for (int point = 0; list >> x >> y >> point;) image.points.push_back({{x, y}, point});
  }
  return images;
}

ColmapModel model_of(const ExportedMap& map) {
  return colmap_model(map.selection, map.images, map.cameras, map.colours).value();
}

// Every observation of a point is where the exported camera projects the point.
void expect_points_project_to_observations(const ExportedMap& map, std::size_t observations) {
  const ColmapModel model = model_of(map);
  const std::map<int, ParsedImage> images = parse_images(model.images);
  std::size_t checked = 0, close = 0;
  for (const std::string& line : data_lines(model.points)) {
    std::istringstream in(line);
    int id = 0, grey = 0, image = 0, index = 0;
    Eigen::Vector3d p;
    double error = 0;
    in >> id >> p.x() >> p.y() >> p.z() >> grey >> grey >> grey >> error;
    while (in >> image >> index) {
      const ParsedImage& seen = images.at(image);
      ASSERT_EQ(seen.points.at(static_cast<std::size_t>(index)).second, id);
      const auto pixel = map.cameras.camera(static_cast<std::size_t>(seen.camera - 1)).project(seen.T_cam_world * p);
      ++checked;
      close +=
          pixel && (*pixel - seen.points[static_cast<std::size_t>(index)].first + Eigen::Vector2d(0.5, 0.5)).norm() < 8;
    }
  }
  EXPECT_GE(checked, observations);
  EXPECT_GT(close, checked * 9 / 10);
}

TEST(ColmapModel, PointsProjectToTheirObservations) {
  const ExportedMap map(synthetic::ring_rig(3));
  std::size_t observations = 0;
  for (const LandmarkId l : map.selection.landmarks)
    for_each_keypoint(map.selection, l, [&](KeyframeId, frame::KeypointRef) { ++observations; });
  expect_points_project_to_observations(map, observations);
}

TEST(ColmapModel, OfUndistortedImagesHasPinholesAndKeypointsWithinThem) {
  const ExportedMap map(synthetic::ring_rig(3), true);
  expect_points_project_to_observations(map, 100);
  const ColmapModel model = model_of(map);
  for (const std::string& line : data_lines(model.cameras))
    EXPECT_NE(line.find(" PINHOLE "), std::string::npos) << line;
  for (const auto& [id, image] : parse_images(model.images)) {
    for (const auto& [pixel, point] : image.points) {
      EXPECT_GE(pixel.minCoeff(), 0.5);
      EXPECT_LE(pixel.x(), map.map.rig().camera(0).width - 0.5);
    }
  }
}

TEST(ColmapModel, FramesOfTheRigGiveThePosesOfTheImages) {
  const ExportedMap map(synthetic::ring_rig(3));
  const ColmapModel model = model_of(map);
  std::map<int, SE3> sensors = {{1, SE3()}};
  ASSERT_EQ(data_lines(model.rigs).size(), 1u);
  std::istringstream rig(data_lines(model.rigs)[0]);
  std::string camera;
  int id = 0, count = 0, reference = 0, has_pose = 0;
  rig >> id >> count >> camera >> reference;
  EXPECT_EQ(count, 3);
  EXPECT_EQ(reference, 1);
  while (rig >> camera >> id >> has_pose) sensors[id] = read_pose(rig);
  ASSERT_EQ(sensors.size(), 3u);
  const std::map<int, ParsedImage> images = parse_images(model.images);
  std::size_t found = 0;
  for (const std::string& line : data_lines(model.frames)) {
    std::istringstream in(line);
    int frame = 0, sensor = 0, image = 0;
    in >> frame >> id;
    const SE3 T_rig_world = read_pose(in);
    in >> count;
    for (int i = 0; i < count; ++i) {
      in >> camera >> sensor >> image;
      EXPECT_EQ(images.at(image).camera, sensor);
      EXPECT_LT((images.at(image).T_cam_world * (sensors.at(sensor) * T_rig_world).inverse()).log().norm(), 1e-9);
      ++found;
    }
  }
  EXPECT_EQ(found, images.size());
  EXPECT_TRUE(model.notes.empty());
}

// Other models of the cameras: what COLMAP's own reader says of them is examined by tests/map_export/colmap_reader.py.
TEST(ColmapModel, HasTheModelsOfColmap) {
  const camera::Intrinsics k{300, 301, 375.5, 239.5};
  const auto line = [&](const camera::CameraModel& model) {
    const ExportedMap map(with_models(synthetic::ring_rig(1), {model}));
    return data_lines(model_of(map).cameras).at(0);
  };
  EXPECT_EQ(line(camera::Fov(k, 0.9)), "1 FOV 752 480 300 301 376 240 0.9");
  EXPECT_EQ(line(camera::Pinhole(k)), "1 PINHOLE 752 480 300 301 376 240");
  EXPECT_EQ(line(camera::Unified(k, 0.5)), "1 EUCM 752 480 300 301 376 240 0.5 1");
  EXPECT_EQ(line(camera::ExtendedUnified(k, 0.5, 1.1)), "1 EUCM 752 480 300 301 376 240 0.5 1.1");
  EXPECT_EQ(line(camera::KannalaBrandt(k, {0.1, 0.2, 0.3, 0.4})),
            "1 OPENCV_FISHEYE 752 480 300 301 376 240 0.1 0.2 0.3 0.4");
  EXPECT_EQ(line(camera::PinholeRadTan(k, {0.1, 0.2, 0.3, 0.4, 0.5})),
            "1 FULL_OPENCV 752 480 300 301 376 240 0.1 0.2 0.3 0.4 0.5 0 0 0");
}

TEST(ColmapModel, RejectsModelsUnknownToColmapUnlessUndistorted) {
  const camera::Rig ring = synthetic::ring_rig(2);
  const camera::Rig rig = with_models(
      ring, {ring.camera(0).model, camera::DoubleSphere(camera::intrinsics(ring.camera(1).model), 0.1, 0.55)});
  const ExportedMap map(rig), undistorted(rig, true);
  const auto model = colmap_model(map.selection, map.images, map.cameras, map.colours);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().key, ring.camera(1).name);
  EXPECT_NE(model.error().expected.find("--undistort"), std::string::npos);
  EXPECT_TRUE(colmap_model(undistorted.selection, undistorted.images, undistorted.cameras, undistorted.colours));
}

TEST(ColmapModel, CamerasOfUnsynchronisedImagesAreRigsOfTheirOwn) {
  map::BundledMap map = storage::small_map(synthetic::ring_rig(2));
  const KeyframeId k(3);
  frame::BundledFrame late = *map.keyframe(k).frame;
  late.cameras[1].time_ns += 20'000'000;
  const camera::Rig& rig = map.rig();
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  for (std::size_t f = 0; f < map.keyframe(k).landmarks.size(); ++f)
    if (const LandmarkId l = map.keyframe(k).landmarks[f]; l.valid()) matches.emplace_back(FeatureId(f), l);
  const KeyframeId added =
      map.add_keyframe(std::make_shared<const frame::BundledFrame>(late), map.keyframe(k).T_rig_world, matches, k);
  geometry::Vector6d twist;
  twist << 0, 0.5, 0, 1, 0, 0;
  ASSERT_TRUE(map.set_twist(added, twist));
  const Selection selection = select_submap(map, 0).value();
  const ImageTable images(selection, nullptr, {});
  EXPECT_GT(largest_capture_shift_px(selection), 1.0);
  const ColmapModel model =
      colmap_model(selection, images, OutputCameras(rig, false), landmark_colours(selection, images)).value();
  EXPECT_EQ(data_lines(model.rigs).size(), 2u);
  EXPECT_EQ(data_lines(model.frames).size(), images.images().size());
  ASSERT_EQ(model.notes.size(), 1u);
  const ParsedImage image = parse_images(model.images).at(images.of(added, 1) + 1);
  EXPECT_LT((image.T_cam_world * map.cam_from_world(added, CameraIndex(1)).inverse()).log().norm(), 1e-9);
}

TEST(ColmapModel, OmitsMissingImages) {
  const map::BundledMap map = storage::small_map(synthetic::ring_rig(3));
  const Selection selection = select_submap(map, 1).value();  // in which camera 1 has no image
  EXPECT_EQ(ImageTable(selection, nullptr, {}).images().size(), 2 * 2u);
  EXPECT_FALSE(select_submap(map, 2));
}

}  // namespace
}  // namespace bslam::map_export
