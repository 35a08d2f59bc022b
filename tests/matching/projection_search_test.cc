#include "matching/projection_search.h"

#include <gtest/gtest.h>

#include <set>

#include "base/random.h"
#include "camera/test_cameras.h"

namespace bslam::matching {
namespace {

using Eigen::Vector3d;
using geometry::SE3;

// 300 points in front of a camera, each with a keypoint close to its projection on the predicted level.
class SearchByProjection : public ::testing::Test {
 protected:
  static constexpr std::size_t kPoints = 300;
  SearchByProjection() {
    Random random(1, "search");
    feature::Detections k;
    while (points.size() < kPoints) {
      const Eigen::Vector2d pixel(random.uniform(20, 619), random.uniform(20, 459));
      const double distance = random.uniform(2, 6);
      const Vector3d in_camera = distance * *camera.unproject(pixel);
      const auto level = static_cast<int>(random.below(6));
      descriptors.push_back({random.next(), random.next(), random.next(), random.next()});
      const double max_pixel = distance * std::pow(1.2, level) * camera.radians_per_pixel();
      points.push_back({T_cam_common.inverse() * in_camera, T_cam_common.rotation().inverse() * in_camera.normalized(),
                        static_cast<float>(max_pixel / std::pow(1.2, 7)), static_cast<float>(max_pixel), nullptr});
      const Eigen::Vector2d off = pixel + 2 * Eigen::Vector2d(random.normal(), random.normal());
      feature::Descriptor seen = descriptors.back();
      for (int b = 0; b < 15; ++b) seen[random.below(4)] ^= std::uint64_t{1} << random.below(64);
      k.pixel.push_back(off.cast<float>());
      k.level.push_back(static_cast<std::uint8_t>(level));
      k.angle.push_back(0);
      k.sigma.push_back(0.7f);
      k.bearing.push_back(*camera.unproject(off));
      k.descriptor.push_back(seen);
      k.patch.emplace_back();
    }
    for (std::size_t i = 0; i < kPoints; ++i) points[i].descriptor = &descriptors[i];
    frame.keypoints = std::move(k);
    frame.grid = frame::FeatureGrid(frame.keypoints, camera.width, camera.height);
  }
  ProjectionSearchResult search(const ProjectionSearchOptions& options = {}) const {
    return search_by_projection(camera::Rig({{camera, {}}}), CameraIndex(0), frame, T_cam_common, points, exclusions,
                                options);
  }

  camera::Camera camera{"pinhole", camera::Pinhole({400, 400, 319.5, 239.5}), 640, 480, 0, ""};
  SE3 T_cam_common = SE3::exp((geometry::Vector6d() << 0.3, -0.8, 0.2, 1, 2, -1).finished());
  frame::CameraFrame frame;
  std::vector<SearchPoint> points;
  std::vector<feature::Descriptor> descriptors;
  SearchExclusions exclusions;
};

TEST_F(SearchByProjection, FindsTheCorrectKeypointsOnce) {
  const ProjectionSearchResult result = search();
  EXPECT_EQ(result.visible.size(), kPoints);
  EXPECT_GT(result.matches.size(), kPoints * 95 / 100);
  std::set<std::uint32_t> keypoints;
  std::uint32_t last = 0;
  for (const ProjectionMatch& m : result.matches) {
    EXPECT_EQ(m.keypoint.index(), m.point);
    EXPECT_TRUE(keypoints.insert(static_cast<std::uint32_t>(m.keypoint.index())).second);
    EXPECT_TRUE(last <= m.point);
    EXPECT_LE(m.hamming, 80);
    last = m.point;
  }
}

TEST_F(SearchByProjection, MatchesAKeypointToTheMostSimilarPoint) {
  points[1] = points[0];  // has the descriptor of keypoint 0
  descriptors[1] = frame.keypoints.descriptor[0];
  points[1].descriptor = &descriptors[1];
  for (const ProjectionMatch& m : search().matches) {
    EXPECT_NE(m.point, 0u);
    if (m.point == 1) {
      EXPECT_EQ(m.keypoint.index(), 0u);
    }
  }
}

TEST_F(SearchByProjection, IgnoresExcludedPointsAndKeypoints) {
  exclusions.points.assign(kPoints, 0);
  for (std::size_t i = 0; i < 100; ++i) exclusions.points[i] = 1;
  exclusions.keypoints.assign(kPoints, 0);
  for (std::size_t i = 100; i < 200; ++i) exclusions.keypoints[i] = 1;
  const ProjectionSearchResult result = search();
  EXPECT_EQ(result.visible.size(), kPoints - 100);  // an excluded keypoint does not make its point invisible
  for (const ProjectionMatch& m : result.matches) EXPECT_GE(m.keypoint.index(), 200u);
  EXPECT_GT(result.matches.size(), 90u);
}

TEST_F(SearchByProjection, SearchesOnlyAroundThePredictedLevel) {
  std::vector<std::uint8_t> levels = frame.keypoints.level.copy();
  for (std::uint8_t& l : levels) l = static_cast<std::uint8_t>(l + 2);
  frame.keypoints.level = std::move(levels);
  EXPECT_LT(search().matches.size(), kPoints / 20);
  EXPECT_GT(search({.level_slack = 2}).matches.size(), kPoints * 9 / 10);
}

// A camera with 1.2^3 times the pixels on the same field of view shows every point three levels higher.
TEST_F(SearchByProjection, ImagesOfAHigherResolutionShowPointsOnCoarserLevels) {
  const std::size_t before = search().matches.size();
  const double factor = std::pow(1.2, 3);
  camera = {"finer", camera::Pinhole({400 * factor, 400 * factor, 319.5 * factor, 239.5 * factor}), 1106, 830, 0, ""};
  std::vector<std::uint8_t> levels = frame.keypoints.level.copy();
  std::vector<Eigen::Vector2f> pixels = frame.keypoints.pixel.copy();
  for (std::uint8_t& l : levels) l = static_cast<std::uint8_t>(l + 3);
  for (Eigen::Vector2f& p : pixels) p *= static_cast<float>(factor);
  frame.keypoints.level = std::move(levels);
  frame.keypoints.pixel = std::move(pixels);
  frame.grid = frame::FeatureGrid(frame.keypoints, camera.width, camera.height);
  EXPECT_EQ(search().visible.size(), kPoints);
  EXPECT_GE(search({.level_slack = 0}).matches.size(), before);
}

TEST_F(SearchByProjection, SearchesOnlyWithinTheViewingAngle) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    Vector3d& direction = points[i].view_direction;
    if (i < 100) direction = -direction;
    if (i >= 100 && i < 200) direction = Eigen::AngleAxisd(1.2, direction.unitOrthogonal()) * direction;
    if (i >= 200 && i < 250) direction = Eigen::AngleAxisd(0.9, direction.unitOrthogonal()) * direction;
    if (i >= 250) direction = Vector3d::Zero();  // unknown
  }
  for (const std::uint32_t i : search().visible) EXPECT_GE(i, 200u);
  EXPECT_EQ(search().visible.size(), 100u);
}

TEST_F(SearchByProjection, SearchesOnlyWithinTheDistanceRange) {
  for (std::size_t i = 0; i < 50; ++i) points[i].max_pixel *= 0.3f;     // too far
  for (std::size_t i = 50; i < 100; ++i) points[i].min_pixel *= 10.0f;  // too near
  for (const std::uint32_t i : search().visible) EXPECT_GE(i, 50u);
  std::size_t near = 0;
  for (const std::uint32_t i : search().visible)
    near += i >= 50 && i < 100 && points[i].min_pixel > 10 * camera.radians_per_pixel();
  EXPECT_EQ(near, 0u);
}

// Levels that differ by 5 % in scale: 15 % beyond the range are three levels beyond the image.
TEST_F(SearchByProjection, LeavesOutPointsThatAreOnNoLevelOfTheImage) {
  for (SearchPoint& p : points) {
    const double pixel_m = (p.position - T_cam_common.inverse().translation()).norm() * camera.radians_per_pixel();
    p.max_pixel = static_cast<float>(pixel_m / 1.15);
    p.min_pixel = static_cast<float>(pixel_m / 1.5);
  }
  EXPECT_EQ(search().visible.size(), kPoints);
  ProjectionSearchOptions options;
  options.scale_factor = 1.05;
  EXPECT_TRUE(search(options).visible.empty());
}

TEST_F(SearchByProjection, IgnoresPointsBehindOrOutsideTheImage) {
  for (SearchPoint& p : points) p.position = T_cam_common.inverse() * -(T_cam_common * p.position);
  const ProjectionSearchResult result = search();
  EXPECT_TRUE(result.visible.empty() && result.matches.empty());
}

TEST_F(SearchByProjection, FindsNothingInACameraWithoutImage) {
  frame = frame::CameraFrame();
  EXPECT_TRUE(search().matches.empty());
}

// Points in all directions around a camera: those that it projects into its image are visible, whatever its field of
// view.
TEST(VisiblePoints, AreThoseThatTheCameraProjectsIntoItsImage) {
  for (const camera::Camera& camera : camera::test_cameras()) {
    Random random(3, camera.name);
    std::vector<SearchPoint> points(5000);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      points[i].position = Vector3d(random.normal(), random.normal(), random.normal());
      const auto pixel = camera.project(points[i].position);
      if (pixel && camera.contains(*pixel)) expected.push_back(i);
    }
    std::vector<std::uint32_t> found;
    for (const VisiblePoint& v : visible_points(camera::Rig({{camera, {}}}), CameraIndex(0), SE3(), points, 1.05))
      found.push_back(v.point);
    EXPECT_EQ(found, expected) << camera.name;
    EXPECT_GT(found.size(), 20u) << camera.name;
  }
}

// Two cameras with the same pose have the same matches; the third has no image.
TEST_F(SearchByProjection, SearchOfAllCamerasEqualsSearchOfEach) {
  const camera::Rig rig({{camera, SE3()}, {camera, SE3()}, {camera, SE3()}});
  frame::BundledFrame bundled;
  bundled.cameras = {frame, frame, frame::CameraFrame()};
  std::vector<SearchExclusions> of_each(3);
  of_each[1].points.assign(kPoints, 0);
  std::fill_n(of_each[1].points.begin(), 50, std::uint8_t{1});
  const std::vector<SE3> poses = camera_poses(rig, T_cam_common);
  ThreadPool pool(2);
  for (ThreadPool* threads : {static_cast<ThreadPool*>(nullptr), &pool}) {
    const auto results = search_cameras(rig, bundled, poses, points, of_each, {}, threads);
    ASSERT_EQ(results.size(), 3u);
    for (std::size_t c = 0; c < 2; ++c) {
      exclusions = of_each[c];
      const ProjectionSearchResult alone = search();
      EXPECT_EQ(results[c].visible, alone.visible);
      ASSERT_EQ(results[c].matches.size(), alone.matches.size());
      for (std::size_t i = 0; i < alone.matches.size(); ++i) {
        EXPECT_EQ(results[c].matches[i].point, alone.matches[i].point);
        EXPECT_EQ(results[c].matches[i].keypoint, alone.matches[i].keypoint);
      }
    }
    EXPECT_LT(results[1].matches.size(), results[0].matches.size());
    EXPECT_TRUE(results[2].matches.empty() && results[2].visible.empty());
  }
}

}  // namespace
}  // namespace bslam::matching
