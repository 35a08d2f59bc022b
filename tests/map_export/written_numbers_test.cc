// What an export says about its files: their frames, and how many landmarks are in them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "evaluation/trajectory_header.h"
#include "map_export/export_map.h"
#include "map_export/exported_map.h"
#include "support/data_on_disk.h"

namespace bslam::map_export {
namespace {

namespace fs = std::filesystem;

class WrittenNumbers : public testing::Test {
 protected:
  WrittenNumbers() : map_(storage::small_map(synthetic::ring_rig(2))) {}

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  // The number of points in a model of COLMAP.
  std::size_t points(const std::string& model) const {
    const std::string text = support::read_text(path(model + "/points3D.txt"));
    return static_cast<std::size_t>(std::ranges::count(text, '\n')) - 1;  // the first line is the title
  }

  // The recording of the map, in grey.
  dataset::Dataset recording() const {
    std::vector<camera::RigCamera> cameras;
    for (std::size_t c = 0; c < 2; ++c) cameras.push_back({map_.rig().camera(c), map_.rig().body_from_cam(c)});
    dataset::Dataset data{"data", dataset::DatasetFormat::kFolder, camera::Rig(cameras), {0, 1}, {}, 0, {}, {}, {}};
    data.pixel_formats.resize(2);
    const fs::path file = folder_.path() / "data/grey.png";
    fs::create_directories(file.parent_path());
    cv::imwrite(file.string(), cv::Mat(map_.rig().camera(0).height, map_.rig().camera(0).width, CV_8UC1, 99));
    const Selection selection = select_submap(map_, 0).value();
    for (const KeyframeId k : selection.keyframes) {
      dataset::FrameEntry entry{map_.keyframe(k).frame->time_ns, {{}, {}}};
      for (std::size_t c = 0; c < 2; ++c)
        entry.images[c] = image_files::ImageFile{file, map_.keyframe(k).frame->cameras[c].time_ns};
      data.frames.push_back(entry);
    }
    return data;
  }

  support::TemporaryFolder folder_;
  map::BundledMap map_;
};

TEST_F(WrittenNumbers, AFolderNamesTheWorldOfEachSubmapByItsNumber) {
  ExportRequest request;
  request.out = path("all");
  request.submap = 1;
  const auto report = export_map(map_, request);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(evaluation::read_comments(path("all/keyframes_0.tum")).parent, "world");
  EXPECT_EQ(evaluation::read_comments(path("all/keyframes_1.tum")).parent, "world_of_submap_1");
  const std::size_t landmarks = select_submap(map_, 1).value().landmarks.size();
  EXPECT_EQ(report->summary, fmt::format("{} keyframes, {} landmarks", map_.num_keyframes(), landmarks));
}

// A pinhole camera does not show all that a fisheye shows.
TEST_F(WrittenNumbers, LandmarksOutsideOfUndistortedImagesAreNotCounted) {
  const dataset::Dataset data = recording();
  ExportRequest request;
  request.format = Format::kColmap;
  request.data = &data;
  request.data_folder = folder_.path() / "data";
  request.submap = 0;
  request.undistort = true;
  request.out = path("undistorted");
  const auto report = export_map(map_, request);
  ASSERT_TRUE(report) << report.error().message();
  const std::size_t all = select_submap(map_, 0).value().landmarks.size(), written = points("undistorted");
  ASSERT_LT(written, all);
  EXPECT_NE(report->summary.find(fmt::format(" {} landmarks,", written)), std::string::npos) << report->summary;
  const std::string note = fmt::format("{} of {} landmarks are not in points3D.txt", all - written, all);
  EXPECT_TRUE(std::ranges::any_of(report->notes, [&](const std::string& n) { return n.starts_with(note); })) << note;
}

}  // namespace
}  // namespace bslam::map_export
