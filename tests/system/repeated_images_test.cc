// Frames in which every camera delivers the image of the frame before again.
#include <gtest/gtest.h>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

using tracking::CameraReason;
using tracking::LostReason;
using tracking::TrackStatus;

constexpr std::size_t kFirst = 12, kEnd = 24;  // frames with the images of the frame before kFirst

void repeat(const image::ImageBundle& from, image::ImageBundle& to) {
  for (std::size_t c = 0; c < to.images.size(); ++c) to.images[c].image = image::copy_of(from.images[c].image.view());
}

TEST(RepeatedImages, OfAMovingRigGiveNoPoseAndTrackingContinuesAfterThem) {
  const RenderedTour& tour = rendered_tour(4, 40);
  std::vector<image::ImageBundle> frames = tour.frames();
  for (std::size_t k = kFirst; k < kEnd; ++k) repeat(frames[kFirst - 1], frames[k]);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const FrameRecord record = must_process(system, frames[k]);
    const bool stalled = k >= kFirst && k < kEnd;
    EXPECT_EQ(record.result.status, stalled ? TrackStatus::kLost : TrackStatus::kTracking) << k;
    if (!stalled) continue;
    EXPECT_EQ(record.result.reason, LostReason::kNoImages) << k;
    for (const tracking::CameraStatus& camera : record.cameras) EXPECT_EQ(camera.reason, CameraReason::kFrozen) << k;
  }
  system.finish();
  EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
}

// Between two frames the landmarks move by less than a pixel.
TEST(RepeatedImages, OfASlowRigGiveNoPoseOnceItWouldHaveMovedVisibly) {
  const RenderedTour tour(2, 40, [](const simulator::Building& building, double duration_s) {
    return simulator::make_tour(building, {.duration_s = duration_s, .speed_mps = 0.1, .seed = 3});
  });
  std::vector<image::ImageBundle> frames = tour.frames();
  for (std::size_t k = kFirst; k < frames.size(); ++k) repeat(frames[kFirst - 1], frames[k]);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  std::vector<FrameRecord> records;
  for (const image::ImageBundle& images : frames) records.push_back(must_process(system, images));
  EXPECT_EQ(records[kFirst].result.status, TrackStatus::kTracking) << "as if the rig stopped";
  EXPECT_EQ(records.back().result.reason, LostReason::kNoImages);
}

// A video that was converted to twice its frame rate, after some frames from which the motion is known.
TEST(RepeatedImages, EverySecondOneIsIgnored) {
  const RenderedTour& tour = rendered_tour(2, 40);
  std::vector<image::ImageBundle> frames = tour.frames();
  for (std::size_t k = 5; k < frames.size(); k += 2) repeat(frames[k - 1], frames[k]);
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (const image::ImageBundle& images : frames) must_process(system, images);
  system.finish();
  EXPECT_GE(tracked_frames(system), frames.size() / 2);
  EXPECT_LT(ate_m(final_poses(system), tour.truth()), 0.01);
}

TEST(RepeatedImages, OfARigAtRestHavePoses) {
  const RenderedTour& tour = rendered_tour(2, 20);
  std::vector<image::ImageBundle> frames = tour.frames();
  for (std::size_t k = 1; k < 10; ++k) repeat(frames[0], frames[k]);  // before the motion is known
  System system(tour.rig(), small_config(execution::Mode::kSequential));
  for (std::size_t k = 0; k < 10; ++k)
    EXPECT_EQ(must_process(system, frames[k]).result.status, TrackStatus::kTracking) << k;
}

}  // namespace
}  // namespace bslam::system
