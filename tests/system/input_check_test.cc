#include "system/input_check.h"

#include <gtest/gtest.h>

#include "synthetic/rigs.h"

namespace bslam::system {
namespace {

class FrameCheck : public ::testing::Test {
 protected:
  FrameCheck() {
    images_.id = FrameId(3);
    images_.time_ns = 1000;
    for (std::size_t c = 0; c < rig_.size(); ++c) {
      const camera::Camera& camera = rig_.camera(c);
      images_.images.push_back({image::ImageState::kPresent, 1000, image::Image(camera.width, camera.height)});
    }
  }
  std::string key(const std::optional<FrameStamp>& before = {}) const {
    const Status status = check_frame(images_, rig_, before);
    return status ? "" : status.error().key;
  }
  camera::Rig rig_ = synthetic::ring_rig(2);
  image::ImageBundle images_;
};

TEST_F(FrameCheck, AcceptsAFrameOfTheRig) {
  EXPECT_EQ(key(), "");
  EXPECT_EQ(key(FrameStamp{FrameId(1), 999}), "");  // ids may have gaps
  images_.images[1] = {};
  EXPECT_EQ(key(), "");  // any image may be missing
}

TEST_F(FrameCheck, ReportsTheInvalidPart) {
  EXPECT_EQ(key(FrameStamp{FrameId(2), 1000}), "time");
  EXPECT_EQ(key(FrameStamp{FrameId(3), 999}), "id");
  images_.images[1].image = image::Image(10, 10);
  EXPECT_EQ(key(), rig_.camera(1).name);
  images_.images.pop_back();
  EXPECT_EQ(key(), "images");
  images_.images.resize(3);
  EXPECT_EQ(key(), "images");
}

TEST_F(FrameCheck, RejectsAFrameWithoutAnId) {
  images_.id = FrameId();
  EXPECT_EQ(key(), "id");
}

}  // namespace
}  // namespace bslam::system
