#include "matching/bundling.h"

#include <gtest/gtest.h>

#include <set>

#include "base/random.h"
#include "matching/frame_builder.h"

namespace bslam::matching {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

// A slanted wall of grey tiles of five centimetres with soft edges, three metres ahead.
class Wall {
 public:
  Wall() {
    Random random(1, "wall");
    for (double& t : tile_) t = random.uniform(20, 235);
  }
  // Intersection of a ray with the wall, rig frame.
  static Vector3d hit(const Vector3d& origin, const Vector3d& direction) {
    const Vector3d normal = Vector3d(0.3, 0.1, -1).normalized(), on(0, 0, 3);
    return origin + direction * (normal.dot(on - origin) / normal.dot(direction));
  }
  double grey(const Vector3d& p) const {
    const double u = p.x() / 0.05, v = p.y() / 0.05;
    const double fu = soft(u - std::floor(u)), fv = soft(v - std::floor(v));
    return (1 - fv) * ((1 - fu) * tile(u, v) + fu * tile(u + 1, v)) +
           fv * ((1 - fu) * tile(u, v + 1) + fu * tile(u + 1, v + 1));
  }

 private:
  static double soft(double t) { return std::clamp(4 * (t - 0.5) + 0.5, 0.0, 1.0); }
  double tile(double u, double v) const {
    const auto i = static_cast<std::uint32_t>(static_cast<int>(std::floor(u)) + 1000),
               j = static_cast<std::uint32_t>(static_cast<int>(std::floor(v)) + 1000);
    return tile_[(i * 131 + j * 31 + (i ^ j)) % tile_.size()];
  }
  std::array<double, 4093> tile_;
};

image::Image render(const Wall& wall, const camera::Camera& camera, const SE3& T_rig_cam) {
  image::Image image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (const double dx : {-0.25, 0.25}) {
        for (const double dy : {-0.25, 0.25}) {
          const auto bearing = camera.unproject({x + dx, y + dy});
          if (bearing) sum += 0.25 * wall.grey(Wall::hit(T_rig_cam.translation(), T_rig_cam.rotation() * *bearing));
        }
      }
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(sum + 0.5, 0.0, 255.0));
    }
  }
  return image;
}

// Three cameras of two models with overlapping views, and one without overlap.
camera::Rig wall_rig() {
  const camera::Camera pinhole{"pinhole", camera::Pinhole({260, 260, 159.5, 119.5}), 320, 240, 0, ""};
  const camera::Camera radtan{
      "radtan", camera::PinholeRadTan({250, 252, 162, 118}, {-0.2, 0.05, 1e-3, -5e-4}), 320, 240, 0, ""};
  const auto at = [](double x, double y, double yaw) {
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitY())), Vector3d(x, y, 0));
  };
  return camera::Rig({{pinhole, at(0, 0, 0)},
                      {radtan, at(0.15, 0.01, -0.03)},
                      {pinhole, at(0.02, 0.12, 0.02)},
                      {pinhole, at(0, 0, 3.1)}});
}

class Bundle : public ::testing::Test {
 protected:
  Bundle() : pool(2), builder(rig.size(), options(), {}) {
    const Wall wall;
    images.images.resize(4);
    for (std::size_t c = 0; c < 3; ++c)
      images.images[c] = {image::ImageState::kPresent, 0, render(wall, rig.camera(c), rig.rig_from_cam(c))};
  }
  static feature::FeatureOptions options() {
    feature::FeatureOptions o;
    o.per_image = 500;
    return o;
  }
  frame::BundledFrame make() {
    const frame::BundledFrame extracted = builder.extract(rig, images, pool);
    return bundle(rig, extracted, builder.pyramids(), {}, alignment, pool);
  }
  const camera::Rig rig = wall_rig();
  const std::vector<AlignmentOptions> alignment = std::vector<AlignmentOptions>(rig.size());
  ThreadPool pool;
  FrameBuilder builder;
  image::ImageBundle images;
};

TEST_F(Bundle, KeypointsOfMatchedFeaturesShowTheSamePoint) {
  const frame::BundledFrame frame = make();
  EXPECT_GT(frame.bundled.num_matched(), 100u);
  std::vector<double> pixel_errors, normalised;
  std::size_t of_three = 0;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    const auto refs = frame.bundled.keypoints(FeatureId(f));
    of_three += refs.size() == 3;
    const frame::KeypointRef first = refs.front();
    const SE3& T_rig_cam = rig.rig_from_cam(first.camera.index());
    const Vector3d bearing = T_rig_cam.rotation() * frame.keypoints(first.camera).bearing[first.keypoint.index()];
    const Vector3d place = Wall::hit(T_rig_cam.translation(), bearing);
    for (const frame::KeypointRef r : refs.subspan(1)) {
      const auto pixel = rig.camera(r.camera).project(rig.cam_from_rig(r.camera) * place);
      ASSERT_TRUE(pixel.has_value());
      pixel_errors.push_back((*pixel - frame.keypoints(r.camera).pixel[r.keypoint.index()].cast<double>()).norm());
    }
    if (const auto& p = frame.bundled.point(FeatureId(f))) {
      const Vector3d ray = p->point_rig.normalized();
      normalised.push_back(std::abs(p->point_rig.norm() - Wall::hit(Vector3d::Zero(), ray).norm()) /
                           std::sqrt(ray.dot(p->covariance * ray)));
    }
  }
  EXPECT_GT(of_three, 30u);
  std::sort(pixel_errors.begin(), pixel_errors.end());
  EXPECT_LT(pixel_errors[pixel_errors.size() / 2], 0.15);
  EXPECT_LT(pixel_errors[pixel_errors.size() * 9 / 10], 0.5);
  std::sort(normalised.begin(), normalised.end());
  ASSERT_GT(normalised.size(), 100u);
  EXPECT_LT(normalised[normalised.size() * 95 / 100], 2.5);  // depth errors in standard deviations
}

// A camera with a multiple of the pixels on the same field of view shows every feature on a coarser level.
TEST(BundleOfResolutions, CamerasOfDifferentResolutionsAreMatched) {
  const Wall wall;
  const auto matched = [&](double factor) {
    const auto camera = [](double f, const char* name) {
      return camera::Camera{name,
                            camera::Pinhole({260 * f, 260 * f, 160 * f - 0.5, 120 * f - 0.5}),
                            static_cast<int>(320 * f),
                            static_cast<int>(240 * f),
                            0,
                            ""};
    };
    const camera::Rig rig(
        {{camera(1, "a"), {}}, {camera(factor, "b"), SE3(Eigen::Quaterniond::Identity(), Vector3d(0.15, 0.01, 0))}});
    ThreadPool pool(1);
    feature::FeatureOptions features;
    features.per_image = 1000;
    FrameBuilder builder(rig.size(), features, {});
    image::ImageBundle images;
    for (std::size_t c = 0; c < rig.size(); ++c)
      images.images.push_back({image::ImageState::kPresent, 0, render(wall, rig.camera(c), rig.rig_from_cam(c))});
    const frame::BundledFrame extracted = builder.extract(rig, images, pool);
    const std::vector<AlignmentOptions> alignment(rig.size());
    return bundle(rig, extracted, builder.pyramids(), {}, alignment, pool).bundled.num_matched();
  };
  const std::size_t equal = matched(1);
  EXPECT_GT(equal, 200u);
  // Most details of the wall are too small to be seen by the coarser camera.
  EXPECT_GT(matched(1.6), equal / 4);
  EXPECT_GT(matched(2.2), equal / 10);
}

TEST_F(Bundle, SatisfiesTheInvariantsOfTheTable) {
  const frame::BundledFrame frame = make();
  EXPECT_EQ(frame.bundled.size(), frame.bundled.num_matched() + frame.bundled.num_monocular());
  std::size_t keypoints = 0;
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    std::set<CameraIndex> cameras;
    for (const frame::KeypointRef r : frame.bundled.keypoints(FeatureId(f))) {
      EXPECT_TRUE(cameras.insert(r.camera).second);
      EXPECT_EQ(frame.bundled.feature(r), FeatureId(f));
      ++keypoints;
    }
  }
  EXPECT_EQ(keypoints, frame.num_keypoints());
  EXPECT_TRUE(frame.cameras[3].keypoints.empty());
}

TEST_F(Bundle, DoesNotDependOnTheNumberOfThreads) {
  const frame::BundledFrame once = make();
  ThreadPool alone(1);
  const frame::BundledFrame extracted = builder.extract(rig, images, alone);
  const frame::BundledFrame again = bundle(rig, extracted, builder.pyramids(), {}, alignment, alone);
  ASSERT_EQ(once.bundled.size(), again.bundled.size());
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(once.cameras[c].keypoints.pixel, again.cameras[c].keypoints.pixel);
  for (std::size_t f = 0; f < once.bundled.num_matched(); ++f) {
    const auto a = once.bundled.keypoints(FeatureId(f)), b = again.bundled.keypoints(FeatureId(f));
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  }
}

TEST_F(Bundle, DoesNotMatchImagesOfOtherTimesWhileTheMotionIsUnknown) {
  frame::BundledFrame extracted = builder.extract(rig, images, pool);
  const auto num_matched = [&] {
    return bundle(rig, extracted, builder.pyramids(), {}, alignment, pool).bundled.num_matched();
  };
  extracted.motion_unknown = true;
  EXPECT_GT(num_matched(), 0u);
  for (std::size_t c = 1; c < extracted.cameras.size(); ++c)
    extracted.cameras[c].time_ns += static_cast<TimeNs>(c) * from_seconds(0.01);
  EXPECT_EQ(num_matched(), 0u);
  extracted.motion_unknown = false;
  EXPECT_GT(num_matched(), 0u);
}

// Only keypoints of matched features are moved, and the detected keypoints are unchanged.
TEST_F(Bundle, MovesOnlyKeypointsOfMatchedFeatures) {
  const frame::BundledFrame extracted = builder.extract(rig, images, pool);
  std::vector<feature::Refinement> detected;
  for (const frame::CameraFrame& c : extracted.cameras) detected.push_back(c.keypoints.positions());
  const frame::BundledFrame frame = bundle(rig, extracted, builder.pyramids(), {}, alignment, pool);
  std::size_t moved = 0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const feature::Keypoints &before = extracted.cameras[c].keypoints, &after = frame.cameras[c].keypoints;
    EXPECT_EQ(before.pixel.copy(), detected[c].pixel);
    EXPECT_EQ(before.sigma.copy(), detected[c].sigma);
    EXPECT_EQ(before.descriptor.data(), after.descriptor.data());  // shared, not copied
    EXPECT_EQ(before.patch.patches().data(), after.patch.patches().data());
    for (std::size_t k = 0; k < after.size(); ++k) {
      const bool same = after.pixel[k] == before.pixel[k] && after.sigma[k] == before.sigma[k] &&
                        after.bearing[k] == before.bearing[k];
      moved += !same;
      EXPECT_TRUE(same || frame.bundled.is_matched(frame.bundled.feature(CameraIndex(c), KeypointIndex(k))));
    }
  }
  EXPECT_GT(moved, frame.bundled.num_matched());
}

TEST_F(Bundle, AMissingOrDamagedImageLeavesItsCameraEmpty) {
  images.images[1] = {image::ImageState::kDamaged, 0, {}};
  const frame::BundledFrame frame = make();
  EXPECT_TRUE(frame.cameras[1].keypoints.empty());
  EXPECT_EQ(frame.cameras[1].state, image::ImageState::kDamaged);
  EXPECT_GT(frame.bundled.num_matched(), 50u);  // matched between cameras 0 and 2
}

}  // namespace
}  // namespace bslam::matching
