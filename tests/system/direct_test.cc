#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "image/pyramid.h"
#include "system/closed_walk.h"
#include "tracking/track_directly.h"

namespace bslam::system {
namespace {

using geometry::SE3;
using tracking::DirectFailure;
using tracking::FrontEnd;

Config with_front_end(FrontEnd front_end) {
  Config config = small_config(execution::Mode::kSequential);
  config.tracking.frontend = front_end;
  return config;
}

std::ptrdiff_t count_direct(const System& system) {
  return std::ranges::count_if(system.frames(), &FrameRecord::direct);
}

TEST(SystemDirect, FindsTheSamePosesAsFeatures) {
  System features(closed_walk().rig(), with_front_end(FrontEnd::kFeatures), {});
  System direct(closed_walk().rig(), with_front_end(FrontEnd::kAuto), {});
  for (System* s : {&features, &direct}) {
    process_all(*s, closed_walk().frames());
    EXPECT_EQ(tracked_frames(*s), kWalk);
    expect_smooth(*s, closed_walk().truth());
    expect_told_where_it_is(*s, closed_walk().truth(), closed_walk().truth().front().T_world_frame);
    s->finish();
  }
  EXPECT_EQ(count_direct(features), 0);
  EXPECT_GT(count_direct(direct), static_cast<std::ptrdiff_t>(kWalk / 2));
  EXPECT_LT(ate_m(final_poses(direct), closed_walk().truth()), 0.005);
}

// The map, the poses and the state of a tracker after some frames of the walk, and the next frame without features.
class DirectTracking : public ::testing::Test {
 protected:
  static constexpr std::size_t kFrames = 14;

  DirectTracking() : pool_(1), alignment_(closed_walk().rig().size()) {
    System system(closed_walk().rig(), with_front_end(FrontEnd::kFeatures), {});
    for (std::size_t k = 0; k <= kFrames; ++k) must_process(system, closed_walk().frames()[k]);
    map_ = system.snapshot();
    const tracking::TrackResult &now = system.frames()[kFrames - 1].result, &next = system.frames()[kFrames].result;
    from_features_ = next.T_rig_world;
    state_.status = tracking::TrackStatus::kTracking;
    state_.time_ns = now.time_ns;
    state_.anchored = map::AnchoredPose::at(*map_, map_->newest_keyframe(), now.T_rig_world);
    for (const LandmarkId l : map_->keyframe(map_->newest_keyframe()).landmarks) {
      if (l.valid()) state_.landmarks.push_back(l);
    }
    std::ranges::sort(state_.landmarks);
    predict(SE3());
    const image::ImageBundle& images = closed_walk().frames()[kFrames];
    options_.keyframe.min_interval = 1000;  // no keyframe is due
    frame_.id = images.id;
    frame_.time_ns = images.time_ns;
    for (const image::CameraImage& i : images.images) {
      frame_.cameras.emplace_back();
      frame_.cameras.back().state = i.state;
      frame_.cameras.back().time_ns = i.time_ns;
      image::build_pyramid(i.view(), 8, 1.2, pyramids_.emplace_back());
    }
  }

  // Sets the motion such that the prediction differs from the pose by `error`.
  void predict(const SE3& error) {
    const TimeNs next_ns = closed_walk().frames()[kFrames].time_ns;
    const SE3 now = *state_.anchored.resolve(*map_);
    state_.twist = (error * from_features_ * now.inverse()).log() / to_seconds(next_ns - state_.time_ns);
    state_.twist_interval_s = to_seconds(next_ns - state_.time_ns);
  }

  tracking::DirectOutput track(std::span<const image::ImageView> masks = {}) {
    const tracking::TrackInput input{
        .map = *map_, .pyramids = pyramids_, .alignment = alignment_, .state = state_, .masks = masks};
    return tracking::track_directly(input, frame_, options_, pool_);
  }

  tracking::TrackingOptions options_;
  ThreadPool pool_;
  map::MapSnapshot map_;
  tracking::TrackerState state_;
  SE3 from_features_;
  frame::BundledFrame frame_;
  std::vector<image::Pyramid> pyramids_;
  std::vector<matching::AlignmentOptions> alignment_;
};

TEST_F(DirectTracking, FindsThePoseIfThePredictionIsOffByALittle) {
  for (const double angle : {0.0, 0.005, -0.01}) {
    predict(SE3::exp((geometry::Vector6d() << 0, angle, 0, 0.005, 0, 0).finished()));
    const auto found = track();
    ASSERT_EQ(found.failure, DirectFailure::kNone) << angle;
    const PoseError error = pose_error(found.output->result.T_rig_world.inverse(), from_features_.inverse());
    EXPECT_LT(error.m, 0.005) << angle;
    EXPECT_LT(error.rad, 0.002) << angle;
    EXPECT_TRUE(found.output->result.covariance.has_value());
  }
}

TEST_F(DirectTracking, FailsIfThePredictionIsFarOff) {
  predict(SE3::exp((geometry::Vector6d() << 0, 0.3, 0, 0, 0, 0).finished()));
  EXPECT_EQ(track().failure, DirectFailure::kNoPose);
  state_.twist.reset();
  EXPECT_EQ(track().failure, DirectFailure::kNoPrediction);
}

TEST_F(DirectTracking, KeypointsOfOneLandmarkAreOneFeature) {
  const auto found = track();
  ASSERT_EQ(found.failure, DirectFailure::kNone);
  const tracking::TrackOutput& output = *found.output;
  EXPECT_GT(output.frame.bundled.num_matched(), 20u);
  std::set<LandmarkId> landmarks;
  std::vector<LandmarkId> of_feature(output.frame.bundled.size());
  for (std::size_t c = 0; c < output.matches.size(); ++c) {
    std::set<LandmarkId> in_camera;
    for (const tracking::Match& m : output.matches[c]) {
      EXPECT_TRUE(in_camera.insert(m.landmark).second);
      landmarks.insert(m.landmark);
      LandmarkId& known = of_feature[output.frame.bundled.feature(CameraIndex(c), m.keypoint).index()];
      EXPECT_TRUE(!known.valid() || known == m.landmark);
      known = m.landmark;
    }
    EXPECT_EQ(output.result.cameras[c].inliers, static_cast<int>(output.matches[c].size()));
    EXPECT_GE(output.result.cameras[c].keypoints, output.result.cameras[c].matched);
  }
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count_if(of_feature, &LandmarkId::valid)), landmarks.size());
}

TEST_F(DirectTracking, IgnoresMaskedPixels) {
  const image::ImageView of_image = closed_walk().frames()[kFrames].images.front().view();
  image::Image left(of_image.width, of_image.height);
  for (int y = 0; y < left.height(); ++y) {
    for (int x = 0; x < left.width(); ++x) left.row(y)[x] = x < left.width() / 2 ? 0 : 255;
  }
  const auto found = track(std::vector{left.view(), image::ImageView()});
  ASSERT_EQ(found.failure, DirectFailure::kNone);
  const float middle = static_cast<float>(left.width() / 2) - 1;
  const auto& of_camera = found.output->frame.cameras;
  EXPECT_TRUE(std::ranges::none_of(of_camera[0].keypoints.pixel, [&](const auto& p) { return p.x() < middle; }));
  EXPECT_TRUE(std::ranges::any_of(of_camera[1].keypoints.pixel, [&](const auto& p) { return p.x() < middle; }));
}

// A camera that loses the landmarks it had before needs features.
// What a camera finds is compared with what it found in earlier frames, in which other cameras had an image.
TEST_F(DirectTracking, AlignsAsManyLandmarksInAnImageIfAnotherCameraHasNone) {
  state_.cameras.resize(frame_.cameras.size());
  for (tracking::CameraConsensusState& camera : state_.cameras) {
    camera.landmarks = state_.landmarks;
    camera.last_image_ns = state_.time_ns;
  }
  options_.direct.per_rig = 160;
  options_.direct.coarse_per_image = 300;
  options_.direct.min_per_image = 20;
  const auto searched = [&] {
    const auto found = track();
    EXPECT_TRUE(found.output.has_value());
    return found.output ? found.output->result.cameras[0].keypoints : 0;
  };
  const int with_all = searched();
  EXPECT_LE(with_all, options_.direct.per_rig / static_cast<int>(frame_.cameras.size()));
  EXPECT_GT(with_all, 40);
  for (std::size_t c = 1; c < frame_.cameras.size(); ++c) frame_.cameras[c].state = image::ImageState::kMissing;
  EXPECT_EQ(searched(), with_all);
  state_.cameras[1].last_image_ns -= 1'000'000'000;  // it failed
  EXPECT_GT(searched(), with_all);
}

TEST_F(DirectTracking, NeedsFeaturesIfACameraLosesItsLandmarks) {
  state_.direct.best_inliers = {60, 100000};
  const auto found = track();
  EXPECT_EQ(found.failure, DirectFailure::kFewInliers);
  ASSERT_TRUE(found.output.has_value());
  EXPECT_FALSE(found.all_cameras);
}

}  // namespace
}  // namespace bslam::system
