// Exports of a map of several recordings whose time stamps are the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "base/random.h"
#include "feature/extractor.h"
#include "image_decoding/image_file.h"
#include "map_export/export_map.h"
#include "map_export/image_table.h"
#include "storage/small_map.h"
#include "storage/submaps.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::map_export {
namespace {

namespace fs = std::filesystem;

// Rectangles of random size, place and brightness, moved to the right by some pixels.
void write_scene(const fs::path& file, const camera::Camera& camera, std::uint64_t seed, int moved) {
  fs::create_directories(file.parent_path());
  Random random(seed);
  cv::Mat image(camera.height, camera.width, CV_8UC1, cv::Scalar(100));
  const auto below = [&random](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  for (int i = 0; i < 400; ++i) {
    const cv::Rect box(moved + below(camera.width), below(camera.height), 8 + below(60), 8 + below(60));
    image(box & cv::Rect(0, 0, camera.width, camera.height)).setTo(below(256));
  }
  ASSERT_TRUE(cv::imwrite(file.string(), image));
}

// Recordings r0, r1 and r2 of one camera, with images at the same times, of which the map contains r0 and r1. Their
// images are from nearly the same places.
class SeveralRecordings : public testing::Test {
 protected:
  static constexpr int kImages = 3;

  SeveralRecordings() : rig_(synthetic::ring_rig(1)), map_(std::make_shared<const camera::Rig>(rig_)) {
    for (int r = 0; r < 3; ++r) {
      for (int i = 0; i < kImages; ++i) write_scene(file(r, i), rig_.camera(0), static_cast<std::uint64_t>(i), 4 * r);
    }
    for (int r = 0; r < 2; ++r) {
      for (int i = 0; i < kImages; ++i) add_keyframe(r, i);
    }
  }

  fs::path root() const { return folder_.path() / "data"; }
  fs::path file(int recording, int i) const { return root() / fmt::format("r{}/{}.png", recording, i); }
  static TimeNs time_of(int i) { return i * 100'000'000; }

  void add_keyframe(int recording, int i) {
    const image::Image image = image_decoding::read_image(file(recording, i)).value();
    feature::Detections detections;
    image::Pyramid pyramid;
    feature::Extractor(feature::FeatureOptions()).extract(image.view(), {}, rig_.camera(0), pyramid, detections);
    ASSERT_GT(detections.size(), 100u);
    frame::BundledFrame frame;
    frame.time_ns = time_of(i);
    frame.cameras.resize(1);
    frame.cameras[0].state = image::ImageState::kPresent;
    frame.cameras[0].time_ns = time_of(i);
    const std::array<std::size_t, 1> counts = {detections.size()};
    frame.bundled = frame::Bundled(counts, {}, {});
    frame.cameras[0].keypoints = std::move(detections);
    const geometry::SE3 T(geometry::Matrix3d::Identity(), {1.0 * i, 1.0 * recording, 0});
    const KeyframeId first = map_.num_keyframes() == 0 ? KeyframeId() : KeyframeId(0);
    map_.add_keyframe(std::make_shared<const frame::BundledFrame>(std::move(frame)), T, {}, first);
  }

  dataset::Dataset recording(int r) const {
    dataset::Dataset data{"", dataset::DatasetFormat::kFolder, rig_, {0}, {}, 0, {}, {}, {}};
    for (int i = 0; i < kImages; ++i)
      data.frames.push_back({time_of(i), {image_files::ImageFile{file(r, i), time_of(i)}}});
    return data;
  }

  support::TemporaryFolder folder_;
  camera::Rig rig_;
  map::BundledMap map_;
};

TEST_F(SeveralRecordings, ImagesBelongToTheKeyframesWhoseKeypointsTheyShow) {
  const Selection selection = select_submap(map_, 0).value();
  for (int r = 0; r < 3; ++r) {
    const dataset::Dataset data = recording(r);
    const ImageTable images(selection, &data, root());
    EXPECT_EQ(images.found(), r < 2 ? std::size_t{kImages} : 0u) << r;
    std::set<std::string> names;
    for (const MapImage& image : images.images()) {
      names.insert(image.name);
      const bool own = image.keyframe.value() / kImages == r;
      EXPECT_EQ(image.recorded.has_value(), own) << image.name;
      EXPECT_EQ(image.name.starts_with(fmt::format("r{}/", r)), own) << image.name;
    }
    EXPECT_EQ(names.size(), images.images().size());
  }
}

TEST_F(SeveralRecordings, ImagesOfAnotherRecordingAreNotThoseOfAMapOfOne) {
  map::BundledMap one(std::make_shared<const camera::Rig>(rig_));
  for (int i = 0; i < kImages; ++i) {
    const map::BundledKeyframe& keyframe = map_.keyframe(KeyframeId(static_cast<std::size_t>(i)));
    one.add_keyframe(keyframe.frame, keyframe.T_rig_world, {}, i == 0 ? KeyframeId() : KeyframeId(0));
  }
  const Selection selection = select_submap(one, 0).value();
  for (int r = 0; r < 3; ++r) {
    const dataset::Dataset data = recording(r);
    EXPECT_EQ(ImageTable(selection, &data, root()).found(), r == 0 ? std::size_t{kImages} : 0u) << r;
  }
}

TEST_F(SeveralRecordings, NamesOfOtherImagesAreUniqueAndNotThoseOfFiles) {
  const Selection selection = select_submap(map_, 0).value();
  std::set<std::string> names;
  const ImageTable unknown(selection, nullptr, {});
  for (const MapImage& image : unknown.images()) names.insert(image.name);
  EXPECT_EQ(names.size(), std::size_t{2 * kImages});
  dataset::Dataset data = recording(1);  // with files that have the names of images without a file
  for (int i = 0; i < kImages; ++i) {
    fs::path& path = data.frames[static_cast<std::size_t>(i)].images[0]->path;
    const fs::path renamed = root() / fmt::format("{}/{}.png", rig_.camera(0).name, time_of(i));
    fs::create_directories(renamed.parent_path());
    fs::rename(path, renamed);
    path = renamed;
  }
  const ImageTable images(selection, &data, root());
  EXPECT_EQ(images.found(), std::size_t{kImages});
  for (const MapImage& image : images.images())
    EXPECT_EQ(fs::exists(root() / image.name), image.recorded.has_value()) << image.name;
}

TEST_F(SeveralRecordings, ANoteSaysHowManyKeyframesATrajectoryDoesNotHave) {
  ExportRequest request;
  for (const Format format : {Format::kNav2, Format::kFolder}) {
    request.format = format;
    request.out = folder_.path() / std::to_string(static_cast<int>(format));
    const auto report = export_map(map_, request);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_TRUE(std::ranges::any_of(report->notes, [](const std::string& note) {
      return note == "3 of 6 keyframes have the time of another one, and are not in keyframes.tum";
    }));
  }
}

}  // namespace
}  // namespace bslam::map_export
