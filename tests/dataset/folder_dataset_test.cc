// Folders of images with names of all kinds, and the times of their images.
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "dataset/recording_description.h"
#include "rig_formats/rig_file.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

bool has_text(const std::vector<std::string>& lines, std::string_view part) {
  return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

// Folders of 60 x 20 pixels, and rigs for them.
class ImageFolders : public testing::Test {
 protected:
  static constexpr int kImages = 6;

  // Writes images named by `name` to a folder; images of different folders differ.
  void add(const std::string& folder, const std::function<std::string(int)>& name) {
    ++folders_;
    for (int k = 0; k < kImages; ++k) support::write_image(data() / folder / name(k), 60, 20, 100 * folders_ + k);
  }
  void add_stamped(const std::string& folder) {
    add(folder, [](int k) { return std::to_string(1'000'000'000'000 + 50'000'000LL * k) + ".png"; });
  }
  static std::string numbered(int k) { return "00000" + std::to_string(k) + ".png"; }

  fs::path rig(const std::vector<std::string>& names) const {
    std::string text = "bslam_rig: 1\ncameras:\n";
    for (const std::string& name : names) {
      text += "  - name: " + name +
              "\n    model: pinhole\n    resolution: [60, 20]\n    intrinsics: [50, 50, 30, 10]\n"
              "    T_body_cam: [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
    }
    const fs::path file = folder_.path() / "rig.yaml";
    support::write_text(file, text);
    return file;
  }
  Result<Dataset> open(const std::vector<std::string>& rig_names, std::vector<std::string> topics = {},
                       TimeStampOptions stamps = {}) const {
    return open_dataset(
        {.path = data(), .rig_file = rig(rig_names), .topics = std::move(topics), .time_stamps = stamps});
  }
  // Expects that opening fails with these words.
  void expect_error(const Result<Dataset>& dataset, std::string_view words) const {
    ASSERT_FALSE(dataset);
    EXPECT_NE(dataset.error().message().find(words), std::string::npos) << dataset.error().message();
  }
  fs::path data() const { return folder_.path() / "walk"; }
  static fs::path folder_of(const Dataset& dataset, std::size_t camera) {
    return dataset.frames[0].images[camera]->path.parent_path().filename();
  }

  support::TemporaryFolder folder_;
  int folders_ = 0;
};

// left and right are the cameras only if no other folder may be one.
TEST_F(ImageFolders, OfTheNamesOfTheRigComeBeforeLeftAndRight) {
  for (const char* name : {"front", "left", "rear", "right"}) add_stamped(name);
  const auto dataset = open({"rear", "front"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(folder_of(*dataset, 0), "rear");
  EXPECT_EQ(folder_of(*dataset, 1), "front");
  EXPECT_TRUE(open({"left", "front", "rear", "right"}));
  expect_error(open({"a", "b"}), "name the folders in their order with --topics");
}

TEST_F(ImageFolders, OfTheNamesOfCamerasAreFoundByName) {
  add_stamped("front");
  add_stamped("rear");
  const auto dataset = open({"rear", "front"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kFolder);
  EXPECT_EQ(folder_of(*dataset, 0), "rear");
  EXPECT_EQ(folder_of(*dataset, 1), "front");
  EXPECT_TRUE(dataset->sources_by_name);
  EXPECT_EQ(dataset->sources[0], (data() / "rear").string());
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
}

TEST_F(ImageFolders, AreDescribedWithTheNumbersOfTheRig) {
  for (const char* name : {"front", "other", "rear"}) add_stamped(name);
  const auto described = describe_recording({.path = data(), .rig_file = rig({"rear", "front"})});
  ASSERT_TRUE(described);
  ASSERT_EQ(described->streams.size(), 3u);
  EXPECT_EQ(described->streams[0].camera, 1);
  EXPECT_EQ(described->streams[1].camera, -1);
  EXPECT_EQ(described->streams[2].camera, 0);
  const auto unclear = describe_recording({.path = data(), .rig_file = rig({"rear", "left"})});
  ASSERT_TRUE(unclear);
  EXPECT_TRUE(has_text(unclear->missing, "--topics"));
}

TEST_F(ImageFolders, OfOtherNamesAreInNaturalOrder) {
  for (const char* name : {"image_10", "image_2", "image_1"}) add_stamped(name);
  const auto dataset = open({"a", "b", "c"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(folder_of(*dataset, 0), "image_1");
  EXPECT_EQ(folder_of(*dataset, 1), "image_2");
  EXPECT_EQ(folder_of(*dataset, 2), "image_10");
  EXPECT_FALSE(dataset->sources_by_name);
}

TEST_F(ImageFolders, TheOrderIsAskedForIfItIsNotClear) {
  for (const char* name : {"infra1", "infra2", "rgb"}) add_stamped(name);
  expect_error(open({"left", "right"}), "--topics");
  expect_error(open({"rgb", "right", "left"}), "name the folders in their order with --topics");
  const auto named = open({"left", "right"}, {"infra2", "infra1"});
  ASSERT_TRUE(named) << named.error().message();
  EXPECT_EQ(folder_of(*named, 0), "infra2");
  EXPECT_EQ(folder_of(*named, 1), "infra1");
  expect_error(open({"left"}, {"infra3"}), "--topics: found infra3, expected folders with images");
  expect_error(open({"left", "right"}, {"rgb", "rgb"}), "rgb twice");
}

TEST_F(ImageFolders, ASubsetOfTheRigIsFoundByName) {
  for (const char* name : {"cam0", "cam2"}) add_stamped(name);
  const auto dataset = open_dataset({.path = data(), .rig_file = rig({"cam0", "cam1", "cam2"}), .cameras = {0, 2}});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(folder_of(*dataset, 1), "cam2");
}

TEST_F(ImageFolders, DepthImagesAndMasksAreLeftOut) {
  for (const char* name : {"depth", "rgb", "masks"}) add_stamped(name);
  const auto dataset = open({"camera"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(folder_of(*dataset, 0), "rgb");
  EXPECT_TRUE(has_text(dataset->warnings, "images in depth, masks are not used"));
  EXPECT_TRUE(has_text(dataset->warnings, "since their names contain depth, mask or vignette"));
  EXPECT_TRUE(open({"camera"}, {"depth"}));
}

TEST_F(ImageFolders, OneFolderIsOneCamera) {
  add_stamped(".");
  const auto dataset = open({"camera"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
}

TEST_F(ImageFolders, TheVaryingDigitsOfANameAreItsStamp) {
  add("cam_left", [](int k) { return "left_2_" + std::to_string(1'000'000'000'000 + 50'000'000LL * k) + ".png"; });
  add("cam_right", [](int k) { return std::to_string(1'000'000'000'000 + 50'000'000LL * k) + "_rgb.jpg"; });
  const auto dataset = open({"l", "r"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_EQ(dataset->frames[2].time_ns, 1'000'100'000'000);
  EXPECT_TRUE(dataset->frames[2].images[1]);
}

TEST_F(ImageFolders, NumbersWithPrefixesTakeARate) {
  add("cam0", [](int k) { return "frame_00012" + std::to_string(k) + ".png"; });
  expect_error(open({"a"}), "--rate HZ if they are image numbers");
  const auto described = describe_recording({.path = data(), .rig_file = rig({"a"})});
  EXPECT_TRUE(has_text(described->missing, "--rate HZ if they are image numbers"));
  const auto dataset = open({"a"}, {}, {.rate_hz = 10});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[1].time_ns, 12'100'000'000);
}

TEST_F(ImageFolders, NamesMayBeDecimalSeconds) {
  add("cam0", [](int k) { return "1403636579.7" + std::to_string(k) + "3555527.png"; });
  add("cam1", [](int k) { return "1403636579.7" + std::to_string(k) + "3555.png"; });
  const auto dataset = open({"a", "b"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_EQ(dataset->frames[1].images[0]->time_ns, 1'403'636'579'713'555'527);
  EXPECT_EQ(dataset->frames[1].images[1]->time_ns, 1'403'636'579'713'555'000);
  expect_error(open({"a", "b"}, {}, {.unit_ns = 1000}), "--stamp-unit: found a recording with times of its own");
}

TEST_F(ImageFolders, NamesOfSecondsMayLackZerosOnOneSide) {
  add("cam0", [](int k) { return "12." + std::to_string(30'000'000 + 50'000'000 * k) + ".png"; });
  auto dataset = open({"a"});  // nanoseconds: 30000000 is no decimal, which would end without zeros
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[0].time_ns, 12'030'000'000);
  EXPECT_EQ(dataset->frames[3].time_ns, 12'180'000'000);
  fs::remove_all(data());
  add("cam0", [](int k) { return "7." + std::to_string(20'000 + 50'001 * k) + ".png"; });  // microseconds
  dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[0].time_ns, 7'020'000'000);
  EXPECT_EQ(dataset->frames[1].time_ns, 7'070'001'000);
  fs::remove_all(data());
  const char* const decimals[] = {"7.2", "7.254321", "7.3", "7.35", "7.4", "7.45"};
  add("cam0", [&](int k) { return std::string(decimals[k]) + ".png"; });
  dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[3].time_ns, 7'350'000'000);
}

TEST_F(ImageFolders, NamesOfSecondsWithZerosOnBothSidesAreAskedAbout) {
  const char* const names[] = {"7.012", "7.070", "7.122345", "7.173211", "7.223100", "7.273000"};
  add("cam0", [&](int k) { return std::string(names[k]) + ".png"; });
  expect_error(open({"a"}), "expected the same number of digits after the point in all names");
}

TEST_F(ImageFolders, NamesOfSeveralKindsAreAskedAbout) {
  add("cam0", [](int k) { return "left_" + numbered(k); });
  add("cam0", [](int k) { return "right_" + numbered(k); });
  expect_error(open({"a"}), "found images with names of several kinds, such as left_000000.png and right_000000.png");
  fs::rename(data() / "cam0", folder_.path() / "both");
  fs::remove_all(data());
  fs::rename(folder_.path() / "both", data());
  expect_error(open({"a", "b"}), "found images with names of several kinds");  // rather than the number of folders
}

TEST_F(ImageFolders, NamesOfDigitsTakePrecedenceWithEveryExtension) {
  for (const std::string kind : {".png", ".webp", ".bmp"}) {
    fs::remove_all(data());
    add("cam0", [&](int k) { return std::to_string(1'000'000'000'000 + 50'000'000LL * k) + kind; });
    for (const char* preview : {"preview_1", "preview_2"})
      support::write_image(data() / "cam0" / (preview + kind), 60, 20);
    const auto dataset = open({"a"});
    ASSERT_TRUE(dataset) << kind << ": " << dataset.error().message();
    EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
    EXPECT_TRUE(has_text(dataset->warnings, "2 files that look like images are not used"));
  }
}

TEST_F(ImageFolders, NamesOfDigitsMayHaveOneExtensionBesidePngAndJpeg) {
  const auto name = [](int k) { return std::to_string(1'000'000'000'000 + 50'000'000LL * k); };
  add("cam0", [&](int k) { return name(k) + ".bmp"; });
  add("cam0", [&](int k) { return name(k) + ".webp"; });
  expect_error(open({"a"}), "found images with names of several kinds");
  add("cam0", [&](int k) { return name(k) + (k % 2 == 0 ? ".png" : ".jpg"); });
  const auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
}

TEST_F(ImageFolders, NamesWithSeveralNumbersAreAskedAbout) {
  add("cam0", [](int k) { return std::to_string(k) + "_" + std::to_string(50'000'000LL * k) + ".png"; });
  expect_error(open({"a"}), "several numbers differ");
}

TEST_F(ImageFolders, FilesThatAreNotUsedAreCounted) {
  add_stamped("cam0");
  support::write_image(data() / "cam0/preview.png", 60, 20);
  support::write_image(data() / "cam0/mean_1.png", 60, 20);
  support::write_text(data() / "cam0/scan.exr", "");
  support::write_text(data() / "cam0/notes.txt", "");
  const auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_TRUE(has_text(dataset->warnings, "3 files that look like images are not used"));
}

TEST_F(ImageFolders, OtherKindsOfFilesAreRead) {
  for (const char* kind : {"pgm", "bmp", "tiff"}) {
    add(kind, [&](int k) { return std::to_string(1'000'000'000'000 + 50'000'000LL * k) + "." + kind; });
  }
  const auto dataset = open({"a", "b", "c"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  const image::ImageBundle bundle = read_frame(*dataset, 3);
  for (const image::CameraImage& image : bundle.images) EXPECT_EQ(image.state, image::ImageState::kPresent);
}

TEST_F(ImageFolders, TimesOfNumbersAreListed) {
  add("image_0", numbered);
  add("left", numbered);
  support::write_text(data() / "image_0/times.txt", "0\n0.1\n0.2\n3e-1\n0.4\n0.5\n");
  fs::rename(data() / "image_0", data() / "front");
  fs::rename(data() / "left", data() / "back");
  support::write_text(data() / "timestamps.txt", "# seconds\n0.00\n0.10\n0.20\n0.30\n0.40\n0.50\n");
  const auto dataset = open({"front", "back"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_EQ(dataset->frames[3].images[0]->time_ns, 300'000'000);
  EXPECT_EQ(dataset->frames[3].images[1]->time_ns, 300'000'000);
  const auto rate = open({"front", "back"}, {}, {.rate_hz = 20});  // says what the numbers are
  ASSERT_TRUE(rate) << rate.error().message();
  EXPECT_EQ(rate->frames[3].time_ns, 150'000'000);
  EXPECT_TRUE(has_text(rate->warnings, "times.txt: not used, since --rate says when the images were taken"));
}

TEST_F(ImageFolders, TheUnitOfAListMayBeGiven) {
  add("cam0", numbered);
  support::write_text(data() / "times.txt", "1000\n1050\n1100\n1150\n1200\n1250\n");
  expect_error(open({"a"}), "--stamp-unit UNIT says what whole numbers are");
  const auto dataset = open({"a"}, {}, {.unit_ns = 1'000'000});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[3].time_ns, 1'150'000'000);
  support::write_text(data() / "times.txt", "1.00\n1.05\n1.10\n1.15\n1.20\n1.25\n");
  expect_error(open({"a"}, {}, {.unit_ns = 1'000'000}),
               "times.txt: found times with a decimal point, which are seconds, expected whole numbers with "
               "--stamp-unit");
}

TEST_F(ImageFolders, ListsMayHavePathsAndNameImagesThatAreNotThere) {
  add("front", numbered);
  add("back", numbered);
  std::string both, own;
  for (int k = 0; k < kImages; ++k) {
    both += std::to_string(1 + k) + ".5 front/" + numbered(k) + "\n";
    own += std::to_string(1 + k) + ".5 ./" + numbered(k) + "\n";
  }
  support::write_text(data() / "times.txt", both);
  support::write_text(data() / "back/times.txt", own);
  fs::remove(data() / "front" / numbered(2));
  fs::remove(data() / "front" / numbered(4));
  const auto dataset = open({"front", "back"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[3].images[1]->time_ns, 4'500'000'000);
  EXPECT_TRUE(has_text(dataset->warnings, "front: 2 of 6 listed images are not there, the first: "));
  EXPECT_TRUE(has_text(dataset->warnings, "front/000002.png"));
}

TEST_F(ImageFolders, OneListMayNameTheImagesOfAllCamerasInOrderOfTime) {
  for (const char* name : {"front", "rear"}) add(name, numbered);
  std::string times;
  for (int k = 0; k < kImages; ++k) {
    for (const char* name : {"front/", "rear/"}) times += "100." + std::to_string(k) + " " + name + numbered(k) + "\n";
  }
  support::write_text(data() / "times.txt", times);
  const auto dataset = open({"front", "rear"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_EQ(dataset->frames[3].images[1]->time_ns, 100'300'000'000);
}

TEST_F(ImageFolders, OneListMayNameImagesThatAreOneFolderDeeper) {
  add("front/data", numbered);
  add("back/data", numbered);
  std::string both;
  for (int k = 0; k < kImages; ++k) {
    both += std::to_string(1 + k) + ".5 front/data/" + numbered(k) + "\n";
    both += std::to_string(1 + k) + ".6 back/data/" + numbered(k) + "\n";
  }
  support::write_text(data() / "times.txt", both);
  const auto dataset = open({"front", "back"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[0].images[0]->time_ns, 1'500'000'000);
  EXPECT_EQ(dataset->frames.back().images[1]->time_ns, 6'600'000'000);
  EXPECT_TRUE(dataset->warnings.empty() || !has_text(dataset->warnings, "another image"));
}

TEST_F(ImageFolders, OfOneCameraMayBeAnyCameraOfTheRig) {
  add_stamped(".");
  const fs::path three = rig({"a", "b", "c"});
  const auto dataset = open_dataset({.path = data(), .rig_file = three, .cameras = {2}});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(0u).name, "c");
  expect_error(open({"a"}, {"front"}), "expected no --topics, since ");
}

TEST_F(ImageFolders, ThatAreNamedAreTheCamerasThatAreSelected) {
  for (const char* name : {"one", "two", "three", "four"}) add_stamped(name);
  const auto dataset = open_dataset(
      {.path = data(), .rig_file = rig({"a", "b", "c", "d"}), .topics = {"three", "one"}, .cameras = {3, 1}});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(0u).name, "d");
  EXPECT_EQ(folder_of(*dataset, 0), "three");
}

TEST_F(ImageFolders, AreDescribedAsARunWouldUseThem) {
  for (const char* name : {"a", "b", "c"}) add(name, numbered);
  fs::remove(data() / "b" / numbered(3));
  const fs::path file = rig({"a", "b", "c"});
  DatasetRequest request{.path = data(), .rig_file = file, .cameras = {2, 1}, .time_stamps = {.rate_hz = 10}};
  auto described = describe_recording(request);
  ASSERT_TRUE(described);
  EXPECT_EQ(described->refusal, "");
  EXPECT_TRUE(described->missing.empty());
  EXPECT_EQ(described->streams[0].camera, -1);
  EXPECT_EQ(described->streams[1].camera, 1);
  EXPECT_EQ(described->streams[2].camera, 0);
  EXPECT_EQ(described->streams[0].times[1], 100'000'000);
  EXPECT_EQ(described->streams[0].stamps, "names, 10 images per second");
  EXPECT_TRUE(
      has_text(described->streams[1].notes, "1 image is missing at 10.0 Hz, the first 0.200 s after its first image"));
  request.begin_s = 5;
  described = describe_recording(request);
  ASSERT_TRUE(described);
  EXPECT_EQ(described->refusal, open_dataset(request).error().message());
  EXPECT_NE(described->refusal.find("a range that contains frames"), std::string::npos);
}

TEST_F(ImageFolders, AJumpOfTheClockIsSaid) {
  add("cam0", [](int k) {
    return std::to_string(1'000'000'000'000 + 50'000'000LL * k + (k > 2) * 300'000'000'000LL) + ".png";
  });
  const auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has_text(
      dataset->warnings,
      "walk: time stamps jump by 300.1 s after 0.100 s: two recordings in one, a clock that was set, or a pause"));
}

// Names that are stamps do not tell the order of capture: two parts of the recording interleave.
TEST_F(ImageFolders, AClockThatWasSetBackIsSaid) {
  const auto warned = [&](int images, const std::function<long long(int)>& ms) {
    ++folders_;
    const fs::path folder = data() / "cam0";
    fs::remove_all(folder);
    for (int k = 0; k < images; ++k)
      support::write_image(folder / (std::to_string(1'000'000'000'000 + 1'000'000 * ms(k)) + ".png"), 60, 20, k);
    const auto dataset = open({"a"});
    return dataset && has_text(dataset->warnings, "as if the clock was set back");
  };
  EXPECT_TRUE(warned(60, [](int k) { return 50 * k - (k >= 30 ? 733 : 0); }));
  EXPECT_FALSE(warned(60, [](int k) { return 50 * k; }));
  EXPECT_FALSE(warned(60, [](int k) { return k < 30 ? 50 * k : 1500 + 25 * (k - 30); }));  // another frame rate
  EXPECT_FALSE(warned(60, [](int k) { return k % 2 == 0 ? 50 * k : 50 * k - 17; }));       // alternating exposures
  EXPECT_FALSE(warned(60, [](int k) { return 50 * (k + k / 3); }));                        // lost images
}

TEST_F(ImageFolders, SecondsAreNoNumbersOfImages) {
  add("cam0", [](int k) { return std::to_string(1'700'000'000 + k) + ".png"; });
  const auto dataset = open({"a"}, {}, {.rate_hz = 10});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has_text(dataset->warnings, "1700000000 and the others are taken for the numbers of images"));
  const auto in_seconds = open({"a"}, {}, {.unit_ns = TimeNs{1'000'000'000}});
  ASSERT_TRUE(in_seconds) << in_seconds.error().message();
  EXPECT_FALSE(has_text(in_seconds->warnings, "numbers of images"));
}

// A camera that sees only shadow is as dark as the others see it.
TEST_F(ImageFolders, AllCamerasOfSixteenBitsHaveTheSameBitsInUse) {
  for (const auto& [name, largest] : {std::pair("bright", 4000), std::pair("dark", 200), std::pair("covered", 0)}) {
    add_stamped(name);
    for (const auto& entry : fs::directory_iterator(data() / name))
      ASSERT_TRUE(cv::imwrite(entry.path().string(), cv::Mat(20, 60, CV_16UC1, cv::Scalar(largest))));
  }
  add_stamped("eight");
  const auto dataset = open({"bright", "dark", "covered", "eight"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->pixel_formats.size(), 4u);
  for (const image_decoding::PixelFormat& format : dataset->pixel_formats) EXPECT_EQ(format.bits, 12);
}

TEST_F(ImageFolders, RecordingsInOtherFoldersAreNamed) {
  for (const char* folder : {"seq1/cam0", "seq1/cam1", "day/seq2/cam0", "day/seq2/cam1"}) add_stamped(folder);
  const auto dataset = open_dataset({.path = data()});
  expect_error(dataset, "found no recording, but folders that look like one in day/seq2, seq1, expected one of them: ");
}

TEST_F(ImageFolders, ImagesOfHalfTheResolutionAreRecognised) {
  for (int k = 0; k < kImages; ++k) support::write_image(data() / "cam0" / numbered(k), 30, 10, k);
  const auto dataset = open({"a"}, {}, {.rate_hz = 10});
  expect_error(dataset, "60x20, the resolution of the calibration; it looks like images of half the resolution");
  const auto described = describe_recording({.path = data(), .rig_file = rig({"a"}), .time_stamps = {.rate_hz = 10}});
  EXPECT_TRUE(has_text(described->missing, "it looks like images of half the resolution"));
}

TEST_F(ImageFolders, ListsMayNameTheImages) {
  add("rgb", [](int k) { return "colour" + std::to_string(k) + "x" + std::to_string(7 * k) + ".png"; });
  std::string tum = "# timestamp filename\n", csv = "timestamp [ns],filename\n";
  for (int k = 0; k < kImages - 1; ++k) {
    const std::string name = "colour" + std::to_string(k) + "x" + std::to_string(7 * k) + ".png";
    tum += "130503110" + std::to_string(k) + ".175304 rgb/" + name + "\n";
    csv += std::to_string(1'000'000'000'000 + 50'000'000LL * k) + "," + name + "\n";
  }
  support::write_text(data() / "rgb.txt", tum);
  auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages) - 1);
  EXPECT_EQ(dataset->frames[4].time_ns, 1'305'031'104'175'304'000);
  EXPECT_EQ(dataset->frames[4].images[0]->path.filename(), "colour4x28.png");
  EXPECT_TRUE(has_text(dataset->warnings, "1 of 6 images in ")) << dataset->warnings[0];
  EXPECT_TRUE(has_text(dataset->warnings, "are not listed and are not used, the first: colour5x35.png"));
  csv += "1000010000000,colour5x35.png\n";
  support::write_text(data() / "rgb/data.csv", csv);
  dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[5].time_ns, 1'000'200'000'000);
  EXPECT_TRUE(has_text(dataset->warnings, "step back 1 time, first from 1000200000000 to 1000010000000"));
}

TEST_F(ImageFolders, ImagesMayBeOneFolderDeeper) {
  add("front/data", numbered);
  std::string csv;
  for (int k = 0; k < kImages; ++k)
    csv += std::to_string(1'000'000'000'000 + 50'000'000LL * k) + "," + numbered(k) + "\n";
  for (const char* list : {"front/data.csv", "front.txt"}) {
    support::write_text(data() / list, csv);
    const auto dataset = open_dataset({.path = data() / "", .rig_file = rig({"front"})});
    ASSERT_TRUE(dataset) << list << dataset.error().message();
    EXPECT_EQ(dataset->frames[3].time_ns, 1'000'150'000'000) << list;
    fs::remove(data() / list);
  }
}

TEST_F(ImageFolders, ListsThatDoNotFitAreRefused) {
  add("cam0", numbered);
  const std::pair<const char*, const char*> cases[] = {
      {"0.0\n0.1\n0.2\n", "times.txt: found 3 times, expected 6, one for each image in"},
      {"0.0\nsoon\n", "times.txt: line 2: found soon, expected TIME"},
      {"0\n1\n2\n3\n4\n5\n", "found whole numbers 1 apart, expected seconds with a decimal point"},
      {"0.0\n50.0\n100.0\n150.0\n200.0\n250.0\n", "found times 50 s apart"},
      {"0.1 elsewhere/1.png\n0.2 elsewhere/2.png\n", "found no image of"}};
  for (const auto& [text, words] : cases) {
    support::write_text(data() / "times.txt", text);
    expect_error(open({"a"}), words);
  }
  support::write_text(data() / "timestamps.txt", "0.0\n");
  expect_error(open({"a"}), "found times.txt and timestamps.txt, expected one file");
}

TEST_F(ImageFolders, StampsInNamesAreUsedRatherThanALoneList) {
  add_stamped("cam0");
  support::write_text(data() / "times.txt", "1.0\n");
  const auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[0].time_ns, 1'000'000'000'000);
}

TEST_F(ImageFolders, TheSameImagesTwiceAreRefused) {
  add_stamped("cam0");
  fs::copy(data() / "cam0", data() / "cam1");
  expect_error(open({"a", "b"}), "cam1: found the same images as in ");
}

TEST_F(ImageFolders, ASingleEqualImageIsNoCopy) {
  add_stamped("cam0");
  add_stamped("cam1");
  const std::string first = "1000000000000.png";
  fs::copy_file(data() / "cam0" / first, data() / "cam1" / first, fs::copy_options::overwrite_existing);
  EXPECT_TRUE(open({"a", "b"}));
}

TEST_F(ImageFolders, NoneOfWhoseImagesCanBeReadAreRefusedWithTheReason) {
  add_stamped("cam0");
  for (const auto& entry : fs::directory_iterator(data() / "cam0")) support::write_text(entry.path(), "no image");
  expect_error(open({"a"}),
               "1000000000000.png: a: found an incomplete image or another format, expected an image that "
               "can be read: none of 6 that were tried can be");
  EXPECT_TRUE(has_text(describe_recording({.path = data()})->missing, "cam0: images that can be read"));
}

TEST_F(ImageFolders, AZeroAmongLargeStampsIsDamaged) {
  add_stamped("cam0");
  support::write_image(data() / "cam0/0.png", 60, 20);
  const auto dataset = open({"a"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(kImages));
  EXPECT_TRUE(has_text(dataset->warnings, "1 image has the damaged time stamp 0 and is not used"));
}

}  // namespace
}  // namespace bslam::dataset
