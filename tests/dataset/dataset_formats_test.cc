// Layouts other than EuRoC, and real recordings if they are present.
#include <gtest/gtest.h>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "rig_formats/rig_file.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;
using image::ImageState;

class SmallKitti : public testing::Test {
 protected:
  void SetUp() override {
    std::string times;
    for (int k = 0; k < 10; ++k) {
      times += std::to_string(k) + ".044989e-01\n";
      for (const int c : {0, 1}) support::write_image(image(k, c), 60, 20, 100 * c + k);
    }
    support::write_text(data() / "times.txt", times);
    support::write_text(data() / "calib.txt",
                        "P0: 50 0 30 0 0 50 10 0 0 0 1 0\nP1: 50 0 30 -25 0 50 10 0 0 0 1 0\n"
                        "P2: 50 0 30 3 0 50 10 0 0 0 1 0\nP3: 50 0 30 -22 0 50 10 0 0 0 1 0\n");
  }
  const fs::path& data() const { return folder_.path(); }
  fs::path image(int k, int c) const {
    return data() / ("image_" + std::to_string(c)) / ("00000" + std::to_string(k) + ".png");
  }
  Result<Dataset> open() const { return open_dataset({.path = data()}); }
  support::TemporaryFolder folder_;
};

TEST_F(SmallKitti, Opens) {
  support::write_text(data() / "poses.txt", "");
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kKitti);
  EXPECT_EQ(dataset->rig.size(), 2u);
  EXPECT_NEAR(dataset->rig.rig_from_cam(1).translation().x(), 0.5, 1e-12);
  ASSERT_EQ(dataset->frames.size(), 10u);
  EXPECT_EQ(dataset->frames[1].time_ns, 104'498'900);
  EXPECT_EQ(dataset->ground_truth, data() / "poses.txt");
  EXPECT_EQ(read_frame(*dataset, 9).images[1].image.width(), 60);
}

TEST_F(SmallKitti, HasSecondsAndTakesNoUnit) {
  const auto rate = open_dataset({.path = data(), .time_stamps = {.rate_hz = 10}});
  ASSERT_FALSE(rate);
  EXPECT_EQ(rate.error().file, "--rate");
}

TEST_F(SmallKitti, AMissingImageIsDamagedAndKeepsItsIndex) {
  fs::remove(image(4, 1));
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(read_frame(*dataset, 4).images[1].state, ImageState::kDamaged);
  EXPECT_EQ(read_frame(*dataset, 5).images[1].state, ImageState::kPresent);
}

TEST_F(SmallKitti, WarnsOfImagesWithoutATime) {
  support::write_image(data() / "image_0" / "000010.png", 60, 20);
  const auto dataset = open();
  ASSERT_TRUE(dataset);
  EXPECT_EQ(dataset->frames.size(), 10u);
  ASSERT_EQ(dataset->warnings.size(), 1u);
  EXPECT_NE(dataset->warnings[0].find("1 images have no time in times.txt and are not used"), std::string::npos);
}

TEST_F(SmallKitti, OfTwoFilesWithOneNumberTheOneWithTheUsualNameIsUsed) {
  for (const char* name : {"1.png", "000001.jpg", "00000001.png"})
    support::write_image(data() / "image_0" / name, 9, 9);
  fs::rename(image(2, 0), data() / "image_0" / "2.png");
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[1].images[0]->path, image(1, 0));
  EXPECT_EQ(dataset->frames[2].images[0]->path, data() / "image_0" / "2.png");
  EXPECT_EQ(dataset->warnings, std::vector{(data() / "image_0").string() +
                                           ": 3 images have the number of another file and are not used, the first: "
                                           "00000001.png"});
}

TEST_F(SmallKitti, RejectsTimesThatAreNoSeconds) {
  std::string times;
  for (int k = 0; k < 10; ++k) times += std::to_string(100'000'000 * k) + "\n";
  support::write_text(data() / "times.txt", times);
  EXPECT_EQ(open().error().found, "times 1e+08 s apart");
}

TEST_F(SmallKitti, RejectsInvalidTimes) {
  support::write_text(data() / "times.txt", "0.0\nsoon\n");
  EXPECT_EQ(open().error().key, "line 2");
  support::write_text(data() / "times.txt", "");
  EXPECT_EQ(open().error().found, "no times");
  fs::remove(data() / "times.txt");
  EXPECT_FALSE(open());
  EXPECT_FALSE(open_dataset({.path = data(), .format = DatasetFormat::kKitti}));
}

TEST_F(SmallKitti, RequiresAProjectionForEveryCamera) {
  support::write_text(data() / "calib.txt", "P0: 50 0 30 0 0 50 10 0 0 0 1 0\n");
  EXPECT_FALSE(open());
  EXPECT_TRUE(open_dataset({.path = data(), .cameras = {0}}));
  fs::remove(data() / "calib.txt");
  EXPECT_EQ(open().error().file, (data() / "calib.txt").string());
}

TEST(FolderDataset, LeftAndRightAreCameras) {
  const support::TemporaryFolder folder;
  support::write_small_euroc(folder.path() / "euroc");
  const fs::path data = folder.path() / "plain";
  fs::create_directories(data);
  fs::rename(folder.path() / "euroc/mav0/cam0/data", data / "left");
  fs::rename(folder.path() / "euroc/mav0/cam1/data", data / "right");
  const auto dataset = open_dataset({.path = data, .rig_file = folder.path() / "euroc"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kFolder);
  EXPECT_EQ(dataset->frames[2].images[0]->path.parent_path(), data / "left");
  EXPECT_EQ(dataset->frames[2].images[1]->path.parent_path(), data / "right");
}

TEST(FolderDataset, ACameraWithItsListBesideItsImagesIsNotEurocs) {
  const support::TemporaryFolder folder;
  support::write_small_euroc(folder.path() / "euroc");
  const fs::path data = folder.path() / "plain";
  for (const std::string camera : {"cam0", "cam1"}) {
    fs::create_directories(data);
    fs::rename(folder.path() / "euroc/mav0" / camera / "data", data / camera);
    fs::copy_file(folder.path() / "euroc/mav0" / camera / "data.csv", data / camera / "data.csv");
  }
  const auto dataset = open_dataset({.path = data, .rig_file = folder.path() / "euroc"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kFolder);
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
}

// Writes the images of cameras of KITTI raw data, and the calibration of the day beside the folders of its drives.
// Camera N is N half metres to the right of camera 0.
void write_kitti_raw(const fs::path& day, const std::vector<int>& cameras) {
  std::string calibration = "calib_time: 09-Jan-2012 13:57:47\n";
  for (const int c : cameras) {
    const std::string number = "_0" + std::to_string(c), shift = std::to_string(-25 * c);
    calibration += "S" + number + ": 60 20\nK" + number + ": 50 0 30 0 50 10 0 0 1\nD" + number + ": 0 0 0 0 0\nR" +
                   number + ": 1 0 0 0 1 0 0 0 1\nT" + number + ": " + std::to_string(-0.5 * c) + " 0 0\nS_rect" +
                   number + ": 60 20\nR_rect" + number + ": 1 0 0 0 1 0 0 0 1\nP_rect" + number + ": 50 0 30 " + shift +
                   " 0 50 10 0 0 0 1 0\n";
    const fs::path folder = day / "drive_0001_sync" / ("image" + number);
    std::string dates;
    for (int k = 0; k < 5; ++k) {
      dates += "2011-09-26 13:02:25." + std::to_string(100000445 + 100000000 * k) + "\n";
      support::write_image(folder / "data" / ("000000000" + std::to_string(k) + ".png"), 60, 20, 100 * c + k);
    }
    support::write_text(folder / "timestamps.txt", dates);
  }
  support::write_text(day / "calib_cam_to_cam.txt", calibration);
}

TEST(KittiRaw, CamerasHaveTheCalibrationOfTheirNumber) {
  const support::TemporaryFolder day;
  write_kitti_raw(day.path(), {0, 2, 3});
  const auto dataset = open_dataset({.path = day.path() / "drive_0001_sync"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->rig.size(), 3u);
  EXPECT_NEAR(dataset->rig.rig_from_cam(1).translation().x(), 1.0, 1e-9);
  EXPECT_NEAR(dataset->rig.rig_from_cam(2).translation().x(), 1.5, 1e-9);
}

TEST(KittiRaw, DatesAndTheCalibrationOfTheDayAreRead) {
  const support::TemporaryFolder day;
  const fs::path data = day.path() / "drive_0001_sync";
  write_kitti_raw(day.path(), {0, 1});
  const DatasetRequest request{.path = data};
  const auto dataset = open_dataset(request);
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kKitti);
  EXPECT_EQ(dataset->first_time_ns, 1317042145100000445);
  ASSERT_EQ(dataset->frames.size(), 5u);
  EXPECT_EQ(dataset->frames[3].time_ns - dataset->first_time_ns, 300'000'000);
  EXPECT_NEAR(dataset->rig.rig_from_cam(1).translation().x(), 0.5, 1e-9);
  EXPECT_EQ(read_frame(*dataset, 4).images[1].state, ImageState::kPresent);

  // A line without a date is an image without a time.
  std::string dates = support::read_text(data / "image_00/timestamps.txt");
  const std::size_t second = dates.find('\n') + 1, third = dates.find('\n', second);
  support::write_text(data / "image_00/timestamps.txt", dates.erase(second, third - second));
  const auto incomplete = open_dataset(request);
  ASSERT_TRUE(incomplete) << incomplete.error().message();
  EXPECT_EQ(incomplete->frames[2].images[0]->path.filename(), "0000000002.png");
  EXPECT_EQ(incomplete->frames[2].time_ns, dataset->frames[2].time_ns);
  EXPECT_FALSE(incomplete->frames[1].images[0]);
  ASSERT_EQ(incomplete->warnings.size(), 1u);
  EXPECT_TRUE(incomplete->warnings[0].ends_with("are not listed and are not used, the first: 0000000001.png"));

  support::write_text(data / "image_00/timestamps.txt", "2011-13-26 13:02:25.9\n");
  EXPECT_EQ(open_dataset(request).error().key, "line 1");
}

TEST(FolderDataset, OpensWithARigFile) {
  const support::TemporaryFolder folder;
  support::write_small_euroc(folder.path() / "euroc");
  const fs::path data = folder.path() / "plain";
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(data);
    fs::rename(folder.path() / "euroc" / "mav0" / camera / "data", data / camera);
  }
  ASSERT_TRUE(
      rig_formats::write_rig(rig_formats::read_rig(folder.path() / "euroc").value(), folder.path() / "rig.yaml"));
  const auto dataset = open_dataset({.path = data, .rig_file = folder.path() / "rig.yaml"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kFolder);
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart);
  EXPECT_EQ(read_frame(*dataset, 3).images[1].state, ImageState::kPresent);
  EXPECT_EQ(open_dataset({.path = data}).error().expected, "a rig file (--rig FILE)");
  EXPECT_FALSE(open_dataset({.path = data, .format = DatasetFormat::kEuroc}));
  EXPECT_FALSE(open_dataset({.path = data, .format = DatasetFormat::kKitti}));
}

TEST(Dataset, ErrorsNameTheKnownLayouts) {
  const support::TemporaryFolder folder;
  const auto dataset = open_dataset({.path = folder.path()});
  ASSERT_FALSE(dataset);
  for (const char* word : {"euroc", "kitti", "folder"}) {
    EXPECT_NE(dataset.error().expected.find(word), std::string::npos) << word;
  }
}

struct Recorded {
  const char* name;
  std::size_t cameras, frames;
  int width, height;
  const char* model;
};

class RecordedDataset : public testing::TestWithParam<Recorded> {};

TEST_P(RecordedDataset, OpensWithItsFramesAndSizes) {
  const auto path = support::shared_data(GetParam().name);
  if (!path) GTEST_SKIP() << "../shared/data/" << GetParam().name << " is not present";
  const auto dataset = open_dataset({.path = *path});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.size(), GetParam().cameras);
  EXPECT_EQ(dataset->frames.size(), GetParam().frames);
  EXPECT_TRUE(dataset->warnings.empty());
  EXPECT_TRUE(dataset->rig.any_overlap());
  for (std::size_t i = 0; i < dataset->rig.size(); ++i) {
    EXPECT_EQ(camera::model_name(dataset->rig.camera(i).model), GetParam().model);
  }
  std::vector<int> seen(dataset->rig.size(), 0);
  for (std::size_t k = 0; k < dataset->frames.size(); k += 3) {
    const image::ImageBundle bundle = read_frame(*dataset, k);
    for (std::size_t i = 0; i < bundle.images.size(); ++i) {
      const image::CameraImage& image = bundle.images[i];
      ASSERT_EQ(image.state != ImageState::kMissing, dataset->frames[k].images[i].has_value());
      if (image.state == ImageState::kMissing) continue;
      ASSERT_EQ(image.state, ImageState::kPresent);
      EXPECT_EQ(image.image.width(), GetParam().width);
      EXPECT_EQ(image.image.height(), GetParam().height);
      ++seen[i];
    }
  }
  for (const int images : seen) EXPECT_GT(images, 0);
}

INSTANTIATE_TEST_SUITE_P(Sets, RecordedDataset,
                         testing::Values(Recorded{"kitti_0039", 4, 160, 1392, 512, "pinhole-radtan"},
                                         Recorded{"kitti_06_start", 2, 20, 1226, 370, "pinhole"},
                                         Recorded{"euroc_v101_rest", 2, 12, 752, 480, "pinhole-radtan"},
                                         Recorded{"aria_gen2_4cam", 4, 9, 512, 512, "kannala-brandt"}),
                         [](const auto& instance) { return instance.param.name; });

// Cameras 2 and 3 of this recording have 25 images each among the 160 of cameras 0 and 1.
TEST(RealDataset, CamerasWithFewImagesJoinTheFramesOfTheOthers) {
  const auto path = support::shared_data("kitti_0039");
  if (!path) GTEST_SKIP() << "../shared/data/kitti_0039 is not present";
  const auto dataset = open_dataset({.path = *path});
  ASSERT_TRUE(dataset);
  std::vector<int> counts(4, 0);
  for (const FrameEntry& frame : dataset->frames) {
    for (std::size_t i = 0; i < 4; ++i) counts[i] += frame.images[i].has_value();
  }
  EXPECT_EQ(counts, (std::vector<int>{160, 160, 25, 25}));
}

// The stamps of these cameras differ by some microseconds, and every image keeps its own.
TEST(RealDataset, ImagesKeepTheirOwnTimes) {
  const auto path = support::shared_data("aria_gen2_4cam");
  if (!path) GTEST_SKIP() << "../shared/data/aria_gen2_4cam is not present";
  const auto dataset = open_dataset({.path = *path});
  ASSERT_TRUE(dataset);
  EXPECT_EQ(dataset->frames[0].images[0]->time_ns, 7385791599780);
  EXPECT_EQ(dataset->frames[0].images[3]->time_ns, 7385791599365);
}

}  // namespace
}  // namespace bslam::dataset
