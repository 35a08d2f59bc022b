#include "storage/map_export.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <sstream>

#include "evaluation/trajectory_file.h"
#include "small_map.h"
#include "synthetic/rigs.h"

namespace bslam::storage {
namespace {

TEST(Submaps, AreSpanningTreesInOrderOfTime) {
  const map::BundledMap map = small_map(synthetic::default_rig());
  const std::vector<Submap> submaps = submaps_of(map);
  ASSERT_EQ(submaps.size(), 2u);
  EXPECT_EQ(submaps[0].keyframes.size() + submaps[1].keyframes.size(), map.num_keyframes());
  EXPECT_EQ(submaps[0].landmarks + submaps[1].landmarks, map.num_landmarks());
  EXPECT_EQ(submaps[1].keyframes.size(), 2u);
  for (const Submap& submap : submaps) {
    const auto trajectory = keyframe_trajectory(map, submap);
    ASSERT_EQ(trajectory.size(), submap.keyframes.size());
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      EXPECT_EQ(map.root_of(submap.keyframes[i]), submap.root);
      if (i > 0) {
        EXPECT_LT(trajectory[i - 1].time_ns, trajectory[i].time_ns);
      }
      const geometry::SE3 round = trajectory[i].T_world_frame * map.keyframe(submap.keyframes[i]).T_rig_world;
      EXPECT_LT(round.log().norm(), 1e-12);
      EXPECT_LE(
          (trajectory[i].T_world_frame.translation() - trajectory[0].T_world_frame.translation()).cwiseAbs().maxCoeff(),
          submap.extent.maxCoeff() + 1e-12);
    }
  }
}

TEST(MapPly, ContainsEveryLandmark) {
  const map::BundledMap map = small_map(synthetic::default_rig());
  const std::string ply = landmarks_ply(map);
  const std::size_t end = ply.find("end_header\n");
  ASSERT_NE(end, std::string::npos);
  EXPECT_NE(ply.find("element vertex " + std::to_string(map.num_landmarks()) + "\n"), std::string::npos);
  ASSERT_EQ(ply.size() - end - 11, map.num_landmarks() * 28);
  Eigen::Vector3d first;
  std::memcpy(first.data(), ply.data() + end + 11, 24);
  EXPECT_EQ(first, map.landmark(map.landmark_ids().front()).position);
}

// Parses the model: every observation of a point is where its camera projects the point.
TEST(ColmapModel, PointsProjectToTheirObservations) {
  const map::BundledMap map = small_map(synthetic::ring_rig(3));
  const ColmapModel model = colmap_model(map).value();
  std::map<int, std::array<double, 8>> cameras;  // fx fy cx cy k1 k2 p1 p2
  std::istringstream in(model.cameras);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    int id, width, height;
    std::string name;
    fields >> id >> name >> width >> height;
    EXPECT_EQ(name, "OPENCV");
    for (double& p : cameras[id]) fields >> p;
  }
  ASSERT_EQ(cameras.size(), 3u);
  struct Image {
    geometry::SE3 T_cam_world;
    int camera;
    std::vector<std::pair<Eigen::Vector2d, int>> points;
  };
  std::map<int, Image> images;
  in = std::istringstream(model.images);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    int id, camera;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    std::string name, points;
    fields >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera >> name;
    EXPECT_TRUE(name.starts_with("cam") && name.ends_with(".png")) << name;
    Image& image = images[id] = {geometry::SE3(q, t), camera, {}};
    std::getline(in, points);
    std::istringstream list(points);
    double x, y;
    for (int point; list >> x >> y >> point;) image.points.push_back({{x, y}, point});
  }
  std::size_t checked = 0, close = 0;
  in = std::istringstream(model.points);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    int id, grey, image, index;
    Eigen::Vector3d p;
    double error;
    fields >> id >> p.x() >> p.y() >> p.z() >> grey >> grey >> grey >> error;
    while (fields >> image >> index) {
      const Image& seen = images.at(image);
      ASSERT_EQ(seen.points.at(static_cast<std::size_t>(index)).second, id);
      const auto& k = cameras.at(seen.camera);
      const camera::PinholeRadTan lens({k[0], k[1], k[2] - 0.5, k[3] - 0.5}, {k[4], k[5], k[6], k[7]});
      const auto pixel = lens.project(seen.T_cam_world * p);
      ++checked;
      close +=
          pixel && (*pixel - seen.points[static_cast<std::size_t>(index)].first + Eigen::Vector2d(0.5, 0.5)).norm() < 8;
    }
  }
  EXPECT_EQ(checked, map.num_observations());
  EXPECT_GT(close, checked / 2);  // the submap without true positions does not agree
}

TEST(ColmapModel, SupportsTheFieldOfViewModel) {
  const camera::Rig ring = synthetic::ring_rig(1);
  camera::Camera camera = ring.camera(0);
  camera.model = camera::Fov({300, 301, 375.5, 239.5}, 0.9);
  const auto model = colmap_model(
      map::BundledMap(std::make_shared<const camera::Rig>(camera::Rig({{camera, ring.body_from_cam(0)}}))));
  ASSERT_TRUE(model) << model.error().message();
  EXPECT_NE(model->cameras.find(fmt::format("1 FOV {} {} 300 301 376 240 0.9\n", camera.width, camera.height)),
            std::string::npos)
      << model->cameras;
}

TEST(ColmapModel, RejectsModelsUnknownToColmap) {
  const camera::Rig ring = synthetic::ring_rig(2);
  std::vector<camera::RigCamera> cameras = {{ring.camera(0), ring.body_from_cam(0)},
                                            {ring.camera(1), ring.body_from_cam(1)}};
  cameras[1].camera.model = camera::DoubleSphere(camera::intrinsics(ring.camera(1).model), 0.1, 0.55);
  const auto model = colmap_model(map::BundledMap(std::make_shared<const camera::Rig>(std::move(cameras))));
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().key, ring.camera(1).name);
}

TEST(ColmapModel, OmitsMissingImages) {
  const map::BundledMap map = small_map(synthetic::ring_rig(3));
  const ColmapModel model = colmap_model(map).value();
  const auto lines = static_cast<std::size_t>(std::ranges::count(model.images, '\n'));
  EXPECT_EQ(lines, 2 + 2 * (map.num_keyframes() * 3 - 2));  // camera 1 was missing twice
}

}  // namespace
}  // namespace bslam::storage
