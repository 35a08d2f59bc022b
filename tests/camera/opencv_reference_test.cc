// Compares projections with OpenCV's if its calib3d module is available.
#include <gtest/gtest.h>

#include "base/random.h"
#include "camera/test_cameras.h"

#if __has_include(<opencv2/calib3d.hpp>)
#include <opencv2/calib3d.hpp>

namespace bslam::camera {
namespace {

cv::Mat matrix_of(const Intrinsics& k) { return (cv::Mat_<double>(3, 3) << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1); }

TEST(CameraModel, ProjectsLikeOpenCV) {
  const cv::Mat zero = cv::Mat::zeros(3, 1, CV_64F);
  for (const Camera& camera : test_cameras()) {
    if (!is_opencv_model(camera.model)) continue;
    Random random(1);
    std::vector<Vector2d> ours;
    std::vector<cv::Point3d> points;
    while (points.size() < 200) {  // OpenCV's models require positive depth
      const Vector3d point(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(0.5, 3));
      const auto pixel = camera.project(point);
      if (!pixel || !camera.contains(*pixel)) continue;
      ours.push_back(*pixel);
      points.emplace_back(point.x(), point.y(), point.z());
    }
    std::vector<cv::Point2d> theirs;
    const std::vector<double> d = distortion(camera.model);
    if (std::holds_alternative<KannalaBrandt>(camera.model)) {
      cv::fisheye::projectPoints(points, theirs, zero, zero, matrix_of(intrinsics(camera.model)), d);
    } else {
      cv::projectPoints(points, zero, zero, matrix_of(intrinsics(camera.model)), d, theirs);
    }
    for (std::size_t i = 0; i < ours.size(); ++i) {
      EXPECT_LT((ours[i] - Vector2d(theirs[i].x, theirs[i].y)).norm(), 1e-9) << camera.name;
    }
  }
}

}  // namespace
}  // namespace bslam::camera
#endif
