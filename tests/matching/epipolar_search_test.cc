#include "matching/epipolar_search.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "base/random.h"

namespace bslam::matching {
namespace {

using camera::Camera;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

Camera pinhole() { return {"pinhole", camera::Pinhole({400, 400, 319.5, 239.5}), 640, 480, 0, ""}; }
Camera radtan() {
  return {"radtan", camera::PinholeRadTan({458, 457, 367, 248}, {-0.283, 0.074, 2e-4, 2e-5}), 752, 480, 0, ""};
}
Camera fisheye() {  // 190 degrees
  return {"fisheye", camera::KannalaBrandt({190, 190, 319.5, 319.5}, {-0.02, 0.004, -8e-4, 5e-5}), 640, 640, 0, ""};
}

struct Pair {
  feature::Detections a, b;  // keypoint k of a and partner[k] of b show the same point; -1: none
  std::vector<int> partner;
};

void add(const Camera& camera, const Vector2d& pixel, int level, const feature::Descriptor& d, feature::Detections& k) {
  k.pixel.push_back(pixel.cast<float>());
  k.level.push_back(static_cast<std::uint8_t>(level));
  k.angle.push_back(0);
  k.sigma.push_back(0.7f);
  k.bearing.push_back(*camera.unproject(pixel));
  k.descriptor.push_back(d);
  k.patch.emplace_back();
}

feature::Descriptor random_descriptor(Random& random) {
  return {random.next(), random.next(), random.next(), random.next()};
}

feature::Descriptor flipped(feature::Descriptor d, int bits, Random& random) {
  for (int i = 0; i < bits; ++i) {
    const std::uint32_t bit = random.below(256);
    d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return d;
}

// Points in all directions at distances of 0.5 to 20 m that a observes; b observes a subset, with noise. The camera
// with more pixels per angle shows them on a coarser level.
Pair seen_by(const Camera& a, const Camera& b, const SE3& T_common_a, const SE3& T_common_b, std::size_t count) {
  Random random(11, "epipolar");
  const int finer =
      static_cast<int>(std::lround(std::log(a.radians_per_pixel() / b.radians_per_pixel()) / std::log(1.2)));
  const int level_a = std::max(0, -finer), level_b = std::max(0, finer);
  Pair out;
  while (out.a.size() < count) {
    const Vector2d pixel(random.uniform(0, a.width - 1), random.uniform(0, a.height - 1));
    const auto bearing = a.unproject(pixel);
    if (!bearing) continue;
    const feature::Descriptor descriptor = random_descriptor(random);
    const double distance = 0.5 * std::pow(40.0, random.uniform());
    const auto there = b.project(T_common_b.inverse() * (T_common_a * (distance * *bearing)));
    add(a, pixel, level_a, descriptor, out.a);
    out.partner.push_back(-1);
    if (!there) continue;
    const Vector2d noisy = *there + 0.5 * Vector2d(random.normal(), random.normal());
    if (!b.contains(noisy) || !b.unproject(noisy)) continue;
    out.partner.back() = static_cast<int>(out.b.size());
    add(b, noisy, level_b, flipped(descriptor, 12, random), out.b);
  }
  for (std::size_t i = 0; i < count / 5; ++i) {  // points observed by b only
    const Vector2d pixel(random.uniform(0, b.width - 1), random.uniform(0, b.height - 1));
    if (b.unproject(pixel)) add(b, pixel, level_b, random_descriptor(random), out.b);
  }
  return out;
}

// A camera with its keypoints and pose.
struct PosedCamera {
  const Camera& camera;
  const feature::Detections& detections;
  const SE3& T_common_cam;
};

std::vector<EpipolarMatch> match(const PosedCamera& a, const PosedCamera& b, const EpipolarOptions& options = {},
                                 std::span<const std::uint8_t> usable_a = {}) {
  const feature::Keypoints keypoints_a{feature::Detections(a.detections)},
      keypoints_b{feature::Detections(b.detections)};
  return match_epipolar({&a.camera, &keypoints_a, a.T_common_cam, usable_a},
                        {&b.camera, &keypoints_b, b.T_common_cam, {}}, options);
}

struct Score {
  std::size_t possible = 0, right = 0, wrong = 0;
};

Score score(const Pair& pair, const std::vector<EpipolarMatch>& matches) {
  Score s;
  for (const int p : pair.partner) s.possible += p >= 0;
  for (const EpipolarMatch& m : matches) ++(pair.partner[m.a.index()] == m.b.value() ? s.right : s.wrong);
  return s;
}

SE3 rotated_pose(double yaw, double pitch, const Vector3d& position) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Vector3d::UnitX())),
          position};
}

TEST(MatchEpipolar, RecoversTrueMatchesOfAnyCamerasInAnyDirection) {
  using std::numbers::pi;
  struct Case {
    const char* name;
    Camera a, b;
    SE3 T_common_a, T_common_b;
  };
  const Case cases[] = {
      {"pinholes side by side", pinhole(), pinhole(), SE3(), rotated_pose(0, 0, {0.11, 0, 0})},
      {"one above the other", pinhole(), radtan(), SE3(), rotated_pose(0.05, 0.02, {0, 0.2, 0})},
      {"radtan, converging", radtan(), radtan(), rotated_pose(0.2, 0, {0, 0, 0}), rotated_pose(-0.2, 0, {0.4, 0, 0.1})},
      {"forward motion", radtan(), radtan(), SE3(), rotated_pose(0, 0, {0.05, 0, 0.3})},
      {"fisheyes at right angles", fisheye(), fisheye(), SE3(), rotated_pose(0.5 * pi, 0, {0.1, 0, 0.1})},
      {"fisheyes back to back", fisheye(), fisheye(), SE3(), rotated_pose(0.9 * pi, 0, {0.1, 0, -0.05})},
      {"both looking back", fisheye(), radtan(), rotated_pose(pi, 0, {0, 0, 0}),
       rotated_pose(pi - 0.1, 0, {0.3, 0.1, 0})},
      {"fisheye and pinhole sideways", fisheye(), pinhole(), SE3(), rotated_pose(-1.2, 0.3, {0, 0, 0.2})},
  };
  for (const Case& c : cases) {
    const Pair pair = seen_by(c.a, c.b, c.T_common_a, c.T_common_b, 800);
    const auto matches = match({c.a, pair.a, c.T_common_a}, {c.b, pair.b, c.T_common_b});
    const Score s = score(pair, matches);
    EXPECT_GT(s.possible, 20u) << c.name;
    EXPECT_GT(static_cast<double>(s.right), 0.85 * static_cast<double>(s.possible)) << c.name;
    EXPECT_LE(s.wrong, 1 + s.right / 100) << c.name;
  }
}

// For every direction of the baseline some epipolar planes lie at the wrap-around of the angle.
TEST(MatchEpipolar, HandlesTheWrapAroundOfTheAngle) {
  const Camera camera = fisheye();
  for (int i = 0; i < 12; ++i) {
    const double turn = 2 * std::numbers::pi * i / 12;
    const SE3 T_common_b(Eigen::Quaterniond::Identity(), 0.3 * Vector3d(std::cos(turn), std::sin(turn), 0.1));
    const Pair pair = seen_by(camera, camera, SE3(), T_common_b, 500);
    const Score s = score(pair, match({camera, pair.a, SE3()}, {camera, pair.b, T_common_b}));
    EXPECT_GT(static_cast<double>(s.right), 0.9 * static_cast<double>(s.possible)) << "baseline " << i;
  }
}

class MatchEpipolarSideBySide : public ::testing::Test {
 protected:
  std::vector<EpipolarMatch> match(const EpipolarOptions& options, std::span<const std::uint8_t> usable_a = {}) const {
    return matching::match({camera, pair.a, SE3()}, {camera, pair.b, T_common_b}, options, usable_a);
  }
  Camera camera = pinhole();
  SE3 T_common_b = rotated_pose(0, 0, {0.2, 0, 0});
  Pair pair = seen_by(camera, camera, SE3(), T_common_b, 600);
};

TEST_F(MatchEpipolarSideBySide, MatchesEveryKeypointAtMostOnceInOrder) {
  std::set<KeypointIndex> a, b;
  KeypointIndex last;
  for (const EpipolarMatch& m : match({})) {
    EXPECT_TRUE(a.insert(m.a).second && b.insert(m.b).second);
    EXPECT_LT(last, m.a);
    last = m.a;
  }
  EXPECT_GT(a.size(), 200u);
}

TEST_F(MatchEpipolarSideBySide, IsSymmetric) {
  std::set<std::pair<int, int>> forth, back;
  for (const EpipolarMatch& m : match({})) forth.insert({m.a.value(), m.b.value()});
  for (const EpipolarMatch& m : matching::match({camera, pair.b, T_common_b}, {camera, pair.a, SE3()})) {
    back.insert({m.b.value(), m.a.value()});
  }
  std::size_t both = 0;
  for (const auto& m : forth) both += back.count(m);
  EXPECT_GT(static_cast<double>(both), 0.98 * static_cast<double>(forth.size()));
}

TEST_F(MatchEpipolarSideBySide, RespectsTheDistanceRange) {
  // Depth is 400 px * 0.2 m / disparity.
  for (const EpipolarMatch& m : match({.min_depth_m = 2.0, .max_depth_m = 5.0})) {
    const double disparity = pair.a.pixel[m.a.index()].x() - pair.b.pixel[m.b.index()].x();
    const double cosine = pair.a.bearing[m.a.index()].z();  // depth is distance times this
    EXPECT_GT(disparity * cosine, 80 / 5.0 - 4);
    EXPECT_LT(disparity * cosine, 80 / 2.0 + 4);
  }
  const std::size_t all = match({}).size(), some = match({.min_depth_m = 2.0, .max_depth_m = 5.0}).size();
  EXPECT_GT(some, all / 10);
  EXPECT_LT(some, all / 2);
}

TEST_F(MatchEpipolarSideBySide, IgnoresAmbiguousAndUnusableKeypoints) {
  const std::size_t all = match({}).size();
  Pair doubled = pair;
  for (std::size_t k = 0; k < pair.a.size(); ++k) {  // a twin of every partner elsewhere on its epipolar line
    if (pair.partner[k] < 0) continue;
    const auto j = static_cast<std::size_t>(pair.partner[k]);
    const Vector2d twin = pair.b.pixel[j].cast<double>() - Vector2d(20, 0);
    if (camera.contains(twin)) add(camera, twin, 0, pair.b.descriptor[j], doubled.b);
  }
  std::swap(pair, doubled);
  EXPECT_LT(match({}).size(), all / 2);
  std::swap(pair, doubled);
  std::vector<std::uint8_t> usable(pair.a.size(), 0);
  std::fill(usable.begin(), usable.begin() + 100, std::uint8_t{1});
  for (const EpipolarMatch& m : match({}, usable)) EXPECT_LT(m.a.value(), 100);
  EXPECT_FALSE(match({}, usable).empty());
}

TEST_F(MatchEpipolarSideBySide, FindsNothingWithoutABaselineOrKeypoints) {
  T_common_b = SE3();
  EXPECT_TRUE(match({}).empty());
  T_common_b = rotated_pose(0, 0, {0.2, 0, 0});
  pair.b.clear();
  EXPECT_TRUE(match({}).empty());
}

TEST_F(MatchEpipolarSideBySide, RejectsDifferentDescriptorsAndLevels) {
  for (const EpipolarMatch& m : match({.max_hamming = 10})) EXPECT_LE(m.hamming, 10);
  for (std::uint8_t& l : pair.b.level) l = 5;
  EXPECT_TRUE(match({.max_level_difference = 2}).empty());
}

}  // namespace
}  // namespace bslam::matching
