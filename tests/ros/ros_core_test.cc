// The logic of the ROS nodes, without ROS and with the public library only.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/camera_info.h"
#include "core/diagnostics.h"
#include "core/geometry.h"
#include "core/image_conversion.h"
#include "core/parameters.h"
#include "core/pose_output.h"
#include "messages/compressed_image.h"
#include "support/data_on_disk.h"

namespace bslam_ros {
namespace {

using Vector3 = std::array<double, 3>;

Pose rotation(double x, double y, double z) {  // exp of a rotation vector
  const double angle = std::sqrt(x * x + y * y + z * z);
  const double s = angle < 1e-12 ? 0.5 : std::sin(0.5 * angle) / angle;
  Pose out;
  out.rotation = {s * x, s * y, s * z, std::cos(0.5 * angle)};
  return out;
}

Pose pose(const Vector3& rotation_vector, const Vector3& translation) {
  Pose out = rotation(rotation_vector[0], rotation_vector[1], rotation_vector[2]);
  out.translation = translation;
  return out;
}

// Small rotation, as a vector in the axes of the parent, from a to b.
Vector3 rotation_between(const Pose& a, const Pose& b) {
  Pose inverse = a.inverse();
  const Pose difference = b * inverse;
  return {2 * difference.rotation[0], 2 * difference.rotation[1], 2 * difference.rotation[2]};
}

const Pose kBaseCam0 = pose({-1.2, 1.2, -1.2}, {0.3, -0.1, 0.5});

TEST(RosGeometry, TimesAreConvertedWithoutLoss) {
  for (const std::int64_t time_ns : {0L, 1L, 999'999'999L, 1'403'636'584'763'555'584L, 2'147'483'647'999'999'999L}) {
    const Stamp stamp = to_stamp(time_ns, 0);
    EXPECT_EQ(to_ns(stamp.sec, stamp.nanosec).value(), time_ns);
  }
  const Stamp before = to_stamp(-1, std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(before.sec, -1);
  EXPECT_EQ(before.nanosec, 999'999'999u);
  EXPECT_EQ(to_stamp(-1, 0).sec, 0);  // ROS 1 begins at 0
  EXPECT_EQ(to_stamp(-1, 0).nanosec, 0u);
  EXPECT_EQ(to_ns(4'294'967'295, 5).value(), 4'294'967'295'000'000'005);  // the last second of ROS 1
  EXPECT_FALSE(to_ns(1, 1'000'000'000));
}

// Moves camera 0 by random motions of a known covariance, and compares the covariance of the base's positions and
// rotations with the converted one.
TEST(RosGeometry, TheCovarianceIsThatOfTheBaseInTheAxesOfItsParent) {
  const Pose T_parent_base = pose({0.4, -0.9, 1.3}, {5, -2, 1});
  const Vector3 rotation_sigma = {0.001, 0.003, 0.002}, translation_sigma = {0.004, 0.001, 0.006};
  bslam::Covariance6 of_cam0 = {};
  for (std::size_t i = 0; i < 3; ++i) {
    of_cam0[7 * i] = rotation_sigma[i] * rotation_sigma[i];
    of_cam0[7 * (i + 3)] = translation_sigma[i] * translation_sigma[i];
  }
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  RosCovariance sampled = {};
  constexpr int kSamples = 20000;
  for (int n = 0; n < kSamples; ++n) {
    Vector3 r, t;
    for (std::size_t i = 0; i < 3; ++i)
      r[i] = rotation_sigma[i] * normal(random), t[i] = translation_sigma[i] * normal(random);
    const Pose moved = T_parent_base * kBaseCam0 * pose(r, t) * kBaseCam0.inverse();
    const Vector3 turn = rotation_between(T_parent_base, moved);
    std::array<double, 6> d;
    for (std::size_t i = 0; i < 3; ++i) d[i] = moved.translation[i] - T_parent_base.translation[i], d[i + 3] = turn[i];
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) sampled[6 * i + j] += d[i] * d[j] / kSamples;
    }
  }
  const RosCovariance converted = to_ros_covariance(of_cam0, kBaseCam0, T_parent_base);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      const double scale = std::sqrt(converted[7 * i] * converted[7 * j]);
      EXPECT_NEAR(sampled[6 * i + j] / scale, converted[6 * i + j] / scale, 0.04) << i << ' ' << j;
    }
  }
}

bslam::CameraCalibration calibration() {
  bslam::CameraCalibration out;
  out.model = "pinhole";
  out.width = 640;
  out.height = 480;
  out.intrinsics = {400, 400, 319.5, 239.5};
  return out;
}

TEST(RosGeometry, ABodyFrameWithOpticalAxesIsRecognisedAndReplaced) {
  const auto rig = bslam::Rig::make({calibration()}).value();
  EXPECT_TRUE(body_has_optical_axes(rig));
  const auto moved = with_base_as_body(rig, kBaseCam0).value();
  EXPECT_FALSE(body_has_optical_axes(moved));
  EXPECT_NEAR(moved.camera(0).T_body_cam.translation[2], 0.5, 1e-12);
}

TEST(RosPoses, MapAndOdomBeginAtBaseLinkWithTheAxesOfTheRobot) {
  bslam::CameraCalibration camera = calibration();
  camera.T_body_cam.rotation = {-0.5, 0.5, -0.5, 0.5};  // x forward, y left, z up
  camera.T_body_cam.translation = {0.2, 0, 0.1};
  PoseConverter converter(bslam::Rig::make({camera}).value());
  bslam::FrameResult frame;
  frame.status = bslam::TrackingStatus::kTracking;
  const auto set = [&](double forward_map, double forward_odom) {  // along the optical axis
    frame.T_world_cam0.translation = {0, 0, forward_map};
    frame.T_odom_cam0.translation = {0, 0, forward_odom};
    frame.T_world_body = frame.T_world_cam0 * camera.T_body_cam.inverse();
    frame.T_odom_body = frame.T_odom_cam0 * camera.T_body_cam.inverse();
  };
  set(0, 0);
  const PoseOutput start = converter.convert(frame);
  set(3, 2);
  const PoseOutput later = converter.convert(frame);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(start.T_map_base.translation[i], 0, 1e-12);
    EXPECT_NEAR(later.T_map_base.translation[i], i == 0 ? 3 : 0, 1e-12);  // forward is x
    EXPECT_NEAR(later.T_odom_base.translation[i], i == 0 ? 2 : 0, 1e-12);
    EXPECT_NEAR(later.T_map_odom.translation[i], i == 0 ? 1 : 0, 1e-12);
  }
  EXPECT_NEAR(std::abs(later.T_map_base.rotation[3]), 1, 1e-12);
  EXPECT_EQ(later.covariance_map, unknown_covariance());
  const auto point = converter.to_map(Vector3{1, 2, 5});  // right, down, forward of camera 0
  EXPECT_NEAR(point[0], 5.2, 1e-12);
  EXPECT_NEAR(point[1], -1, 1e-12);
  EXPECT_NEAR(point[2], -1.9, 1e-12);

  converter.restart();  // another System, whose odometry begins anew
  set(7, 0);
  const PoseOutput other = converter.convert(frame);
  EXPECT_NEAR(other.T_odom_base.translation[0], 2, 1e-12);
  EXPECT_NEAR(other.T_map_odom.translation[0], 5, 1e-12);
}

RawImage image_of(const char* encoding, const std::vector<std::uint8_t>& data, std::size_t width, std::size_t step) {
  RawImage out;
  out.encoding = encoding;
  out.width = width;
  out.height = data.size() / step;
  out.step = step;
  out.data = data.data();
  out.size = data.size();
  return out;
}

int first_pixel(const RawImage& image, int significant_bits = 16) {
  const auto grey = to_grey(image, 5, significant_bits);
  EXPECT_TRUE(grey) << grey.error().message();
  EXPECT_EQ(grey->time_ns, 5);
  return grey->data[0];
}

TEST(RosImages, EveryEncodingBecomesGrey) {
  const std::vector<std::uint8_t> bytes = {10, 20, 30, 40};
  EXPECT_EQ(first_pixel(image_of("mono8", bytes, 4, 4)), 10);
  EXPECT_EQ(first_pixel(image_of("rgb8", bytes, 1, 4)), 18);  // 0.299 * 10 + 0.587 * 20 + 0.114 * 30
  EXPECT_EQ(first_pixel(image_of("bgra8", bytes, 1, 4)), 22);
  EXPECT_EQ(first_pixel(image_of("yuv422", bytes, 2, 4)), 20);
  EXPECT_EQ(first_pixel(image_of("yuv422_yuy2", bytes, 2, 4)), 10);
  RawImage wide = image_of("mono16", bytes, 2, 4);
  EXPECT_EQ(first_pixel(wide), 20);  // little endian: 20 * 256 + 10
  wide.big_endian = true;
  EXPECT_EQ(first_pixel(wide), 10);
  EXPECT_EQ(first_pixel(wide, 12), 161);  // (10 * 256 + 20) / 16
}

TEST(RosImages, GreyPixelsAreSharedAndBayerPatternsAreSmoothed) {
  const std::vector<std::uint8_t> grey(12, 7);
  RawImage image = image_of("8UC1", grey, 5, 6);
  image.owner = std::make_shared<int>(1);
  const auto shared = to_grey(image, 0).value();
  EXPECT_EQ(shared.data, grey.data());
  EXPECT_EQ(shared.stride, 6);
  EXPECT_EQ(shared.owner, image.owner);
  std::vector<std::uint8_t> mosaic(64);  // a uniform colour: R 200, G 100, B 40
  for (std::size_t y = 0; y < 8; ++y) {
    for (std::size_t x = 0; x < 8; ++x) mosaic[8 * y + x] = y % 2 != x % 2 ? 100 : y % 2 == 0 ? 200 : 40;
  }
  const auto smooth = to_grey(image_of("bayer_rggb8", mosaic, 8, 8), 0).value();
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(smooth.data[i], 110) << i;  // (200 + 2 * 100 + 40) / 4
}

TEST(RosImages, LyingImagesAreErrors) {
  const std::vector<std::uint8_t> bytes(16);
  RawImage image = image_of("mono8", bytes, 4, 4);
  EXPECT_TRUE(to_grey(image, 0));
  RawImage taller = image;
  taller.height = 5;
  EXPECT_EQ(to_grey(taller, 0).error().key, "data");
  RawImage narrow = image;
  narrow.step = 3;
  EXPECT_EQ(to_grey(narrow, 0).error().key, "step");
  RawImage huge = image;
  huge.height = huge.width = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(to_grey(huge, 0).error().key, "size");
  EXPECT_EQ(to_grey(image_of("32FC1", bytes, 1, 4), 0).error().key, "encoding");
  EXPECT_EQ(to_grey(image_of("mono8", {}, 4, 4), 0).error().key, "size");
}

TEST(RosImages, CompressedImagesThatAreCutOffAreErrors) {
  cv::Mat picture(40, 60, CV_8UC1);
  for (int i = 0; i < 40 * 60; ++i) picture.data[i] = static_cast<std::uint8_t>(37 * i % 251);
  for (const char* format : {".jpg", ".png"}) {
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(cv::imencode(format, picture, bytes));
    const auto image = decode(bytes, format);
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->width, 60u);
    std::vector<std::uint8_t> filled = bytes;
    filled.resize(bytes.size() + 100);
    EXPECT_TRUE(decode(filled, format)) << format;
    for (const std::size_t size : {bytes.size() - 1, bytes.size() - 100, bytes.size() / 2, std::size_t{3}}) {
      const std::vector<std::uint8_t> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      const auto cut = decode(part, format);
      ASSERT_FALSE(cut) << format << ' ' << size;
      EXPECT_NE(cut.error().message().find("expected a complete JPEG or PNG image"), std::string::npos);
    }
  }
  EXPECT_FALSE(decode({}, "jpeg"));
  EXPECT_FALSE(decode(std::vector<std::uint8_t>(50), "jpeg"));
}

// Files of one channel contain the pixels behind the colour filter that their format names.
TEST(RosImages, CompressedBayerImagesAreReadAsRawOnes) {
  cv::Mat raw(40, 60, CV_8UC1);
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x)
      raw.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(y % 2 == x % 2 ? (x % 2 == 0 ? 200 : 40) : 100);
  }
  const auto png = [](const cv::Mat& image) {
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(cv::imencode(".png", image, bytes));
    return bytes;
  };
  cv::Mat words;
  raw.convertTo(words, CV_16U, 16);
  RawImage same;
  same.encoding = "bayer_rggb8";
  same.width = 60;
  same.height = 40;
  same.step = raw.step;
  same.data = raw.data;
  same.size = raw.total();
  const auto expected = to_grey(same, 0);
  ASSERT_TRUE(expected);
  for (const auto& [image, format, bits] : {std::tuple(raw, "bayer_rggb8; png compressed ", 16),
                                            {raw, "bayer_rggb8; png compressed bayer_rggb8", 16},
                                            {words, "bayer_rggb16; png compressed ", 12}}) {
    const auto decoded = decode(png(image), format);
    ASSERT_TRUE(decoded) << decoded.error().message();
    const auto grey = to_grey(*decoded, 0, bits);
    ASSERT_TRUE(grey) << grey.error().message();
    for (std::size_t k = 0; k < raw.total(); ++k) ASSERT_EQ(grey->data[k], expected->data[k]) << format << ", " << k;
  }
  EXPECT_EQ(decode(png(raw), "bayer_rggb8; png compressed mono8")->encoding, "mono8");
  EXPECT_EQ(decode(png(raw), "mono8; png compressed ")->encoding, "mono8");
  EXPECT_EQ(decode(png(raw), "png")->encoding, "mono8");
  const auto colours = decode(png(cv::Mat(40, 60, CV_8UC3, cv::Scalar(90, 90, 90))), "bayer_rggb8; png compressed ");
  ASSERT_TRUE(colours) << colours.error().message();
  EXPECT_EQ(colours->encoding, "mono8");
  EXPECT_EQ(colours->data[7], 90);
}

TEST(RosImages, MetadataDoNotTurnCompressedImages) {
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(40, 60, CV_8UC1, cv::Scalar(90)), bytes));
  // Exif with one entry: orientation (0x112), of type short, is 6, a quarter turn.
  const std::vector<std::uint8_t> exif = {0xff, 0xe1, 0, 34, 'E', 'x', 'i', 'f', 0, 0, 'M', 'M', 0, 42, 0, 0, 0, 8,
                                          0,    1,    1, 18, 0,   3,   0,   0,   0, 1, 0,   6,   0, 0,  0, 0, 0, 0};
  bytes.insert(bytes.begin() + 2, exif.begin(), exif.end());
  ASSERT_EQ(cv::imdecode(bytes, cv::IMREAD_GRAYSCALE).cols, 40);  // turned
  const auto image = decode(bytes, "jpeg");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->width, 60u);
  EXPECT_EQ(image->height, 40u);
}

CameraInfo info(const char* model, std::vector<double> D) {
  CameraInfo out;
  out.frame_id = "left_optical";
  out.width = 640;
  out.height = 480;
  out.distortion_model = model;
  out.D = std::move(D);
  out.K = {400, 0, 319.5, 0, 410, 239.5, 0, 0, 1};
  return out;
}

TEST(RosCameraInfo, DistortionModelsAreThoseOfTheLibrary) {
  const auto model = [](const CameraInfo& i) { return make_rig({i}, {"left"}, {Pose()}).value().camera(0).model; };
  EXPECT_EQ(model(info("plumb_bob", {-0.28, 0.07, 1e-4, 2e-5, 0.01})), "pinhole-radtan");
  EXPECT_EQ(model(info("plumb_bob", {0, 0, 0, 0, 0})), "pinhole");
  EXPECT_EQ(model(info("rational_polynomial", {0.1, 0.2, 0, 0, 0.01, 0.1, 0.1, 0.01})), "pinhole-radtan");
  EXPECT_EQ(model(info("equidistant", {0.01, 0.02, 0.001, 0})), "kannala-brandt");
  EXPECT_EQ(model(info("kannala_brandt", {0.01, 0.02, 0.001, 0})), "kannala-brandt");
  EXPECT_EQ(model(info("equidistant", {})), "kannala-brandt");
  EXPECT_EQ(model(info("", {-0.28})), "pinhole-radtan");
  const auto coefficients = [](const CameraInfo& i) { return to_calibration(i, "left", Pose()).value().distortion; };
  using Numbers = std::vector<double>;
  EXPECT_EQ(coefficients(info("plumb_bob", {-0.28})), (Numbers{-0.28, 0, 0, 0}));
  EXPECT_EQ(coefficients(info("plumb_bob", {1, 2, 3, 4, 5, 0, 0, 0})), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(coefficients(info("rational_polynomial", {1, 2, 3, 4, 5, 6})), (Numbers{1, 2, 3, 4, 5, 6, 0, 0}));
  EXPECT_EQ(coefficients(info("rational_polynomial", {1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0})).size(), 8u);
  EXPECT_EQ(coefficients(info("equidistant", {0.1, 0.2, 0, 0, 0})), (Numbers{0.1, 0.2, 0, 0}));
  const auto found = [](const CameraInfo& i) { return to_calibration(i, "left", Pose()).error().message(); };
  EXPECT_NE(found(info("plumb_bob", {1, 2, 3, 4, 5, 6})).find("left: camera_info: D: found 6 coefficients"),
            std::string::npos);
  EXPECT_NE(found(info("fisheye", {1, 2, 3, 4, 5})).find("expected at most 4"), std::string::npos);
  EXPECT_NE(found(info("omni", {1})).find("give a rig file"), std::string::npos);
  CameraInfo uncalibrated = info("plumb_bob", {});
  uncalibrated.K = {};
  EXPECT_NE(found(uncalibrated).find("K: found 0"), std::string::npos);
}

TEST(RosCameraInfo, BinningAndRegionChangeTheIntrinsics) {
  CameraInfo part = info("plumb_bob", {});
  part.binning_x = part.binning_y = 2;
  part.roi_x = 100;
  part.roi_y = 40;
  part.roi_width = 400;
  part.roi_height = 200;
  const auto camera = to_calibration(part, "left", Pose()).value();
  EXPECT_EQ(camera.width, 200);
  EXPECT_EQ(camera.height, 100);
  EXPECT_DOUBLE_EQ(camera.intrinsics[0], 200);
  EXPECT_DOUBLE_EQ(camera.intrinsics[2], (319.5 - 100 + 0.5) / 2 - 0.5);
  EXPECT_DOUBLE_EQ(camera.intrinsics[3], (239.5 - 40 + 0.5) / 2 - 0.5);
}

TEST(RosCameraInfo, CamerasOfOneFrameAreRefused) {
  const CameraInfo left = info("plumb_bob", {});
  const auto rig = make_rig({left, left}, {"left", "right"}, {Pose(), Pose()});
  ASSERT_FALSE(rig);
  EXPECT_NE(rig.error().message().find("which is also that of left"), std::string::npos);
}

TEST(RosParameters, AreChecked) {
  Parameters parameters;
  EXPECT_FALSE(parameters.check());
  parameters.image_topics = {"/stereo/left/image_raw", "/stereo/right/image_raw/compressed"};
  EXPECT_TRUE(parameters.check());
  EXPECT_EQ(parameters.camera_info_topic(0), "/stereo/left/camera_info");
  EXPECT_EQ(parameters.camera_info_topic(1), "/stereo/right/camera_info");
  EXPECT_EQ(camera_names(parameters), (std::vector<std::string>{"left", "right"}));
  parameters.settings = {"features.per_image=900"};
  EXPECT_EQ(parameters.make_config().value().get("features.per_image").value(), "900");
  const auto refused = [&](auto change) {
    Parameters changed = parameters;
    change(changed);
    return !changed.check();
  };
  EXPECT_TRUE(refused([](Parameters& p) { p.image_topics[1] = p.image_topics[0]; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.cameras = {0}; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.camera_info_topics = {"a"}; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.odom_frame = p.map_frame; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.map_frame = "my map"; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.settings = {"features.per_image"}; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.max_bundles = 0; }));
  EXPECT_TRUE(refused([](Parameters& p) { p.sync_tolerance = std::nan(""); }));
  parameters.image_topics = {"image", "other"};
  EXPECT_EQ(camera_names(parameters), (std::vector<std::string>{"cam0", "cam1"}));
}

TEST(RosParameters, RectifiedImagesNeedARigFile) {
  EXPECT_TRUE(is_rectified("/left/image_rect"));
  EXPECT_TRUE(is_rectified("/left/image_rect_color/compressed"));
  EXPECT_TRUE(is_rectified("image_rect"));
  EXPECT_FALSE(is_rectified("/left/image_rect_raw"));  // of a RealSense: the lens's own images
  EXPECT_FALSE(is_rectified("/image_rect/image_raw"));
  Parameters parameters;
  parameters.image_topics = {"/left/image_raw", "/right/image_rect"};
  ASSERT_FALSE(parameters.check());
  EXPECT_NE(parameters.check().error().message().find("/right/image_rect, whose images are rectified"),
            std::string::npos);
  parameters.rig = "rectified.yaml";
  EXPECT_TRUE(parameters.check());
}

TEST(RosParameters, AreDocumented) {
  const std::string page = bslam::support::read_text(BSLAM_SOURCE_DIR "/docs/ros.md");
  const std::size_t begin = page.find("## Parameters"), end = page.find("## Diagnostics");
  ASSERT_LT(begin, end);
  const std::string table = page.substr(begin, end - begin);
  int parameters = 0, rows = 0;
  Parameters defaults;
  Parameters::visit(defaults, [&](const char* name, const auto&, const char* help) {
    const std::size_t row = table.find("\n| `" + std::string(name) + "` | ");
    ASSERT_NE(row, std::string::npos) << name;
    EXPECT_NE(table.substr(row, table.find('\n', row + 1) - row).find(help), std::string::npos) << name << ": " << help;
    ++parameters;
  });
  for (std::size_t at = 0; (at = table.find("\n| `", at)) != std::string::npos; ++at) ++rows;
  EXPECT_EQ(rows, parameters);
}

TEST(RosParameters, DeliveryIsReliableIfAllPublishersOfferIt) {
  EXPECT_FALSE(subscribe_reliably({}));  // whoever comes later must be compatible
  EXPECT_TRUE(subscribe_reliably({true, true}));
  EXPECT_FALSE(subscribe_reliably({true, false}));
}

TEST(RosDiagnostics, LossAndFailedCamerasAreErrors) {
  Report report;
  report.cameras.resize(2);
  report.cameras[0].name = "left";
  report.cameras[1].name = "right";
  EXPECT_EQ(to_diagnostics(report)[0].level, Level::kWarn);  // waiting for images
  bslam::FrameResult frame;
  frame.status = bslam::TrackingStatus::kTracking;
  frame.cameras.resize(2);
  report.last = frame;
  EXPECT_EQ(to_diagnostics(report)[0].level, Level::kOk);
  EXPECT_EQ(to_diagnostics(report)[2].name, "bslam: camera right");
  report.last->cameras[1].state = bslam::CameraState::kOut;
  report.last->cameras[1].reason = "black";
  EXPECT_EQ(to_diagnostics(report)[2].level, Level::kError);
  EXPECT_EQ(to_diagnostics(report)[2].message, "out: black");
  report.last->scale = bslam::Scale::kUpToScale;
  EXPECT_EQ(to_diagnostics(report)[0].level, Level::kWarn);
  report.last->status = bslam::TrackingStatus::kLost;
  report.last->reason = bslam::LostReason::kFewMatches;
  EXPECT_EQ(to_diagnostics(report)[0].level, Level::kError);
  EXPECT_EQ(to_diagnostics(report)[0].message, "lost: few-matches");
  report.seconds_silent = 3;
  EXPECT_EQ(to_diagnostics(report)[0].level, Level::kStale);
  report.cameras[0].rejected = 2;
  report.cameras[0].last_error = "image: encoding";
  EXPECT_EQ(to_diagnostics(report)[1].message, "image: encoding");
}

}  // namespace
}  // namespace bslam_ros
