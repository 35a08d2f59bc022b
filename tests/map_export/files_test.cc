// Exports as files: point clouds, nerfstudio, undistorted images and colours of a recording.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <tuple>

#include "map/rigs_of_map.h"
#include "map_export/colmap_model.h"
#include "map_export/export_map.h"
#include "map_export/exported_map.h"
#include "map_export/nerfstudio.h"
#include "map_export/point_cloud.h"
#include "rig_formats/rig_file.h"
#include "support/data_on_disk.h"

namespace bslam::map_export {
namespace {

namespace fs = std::filesystem;

using support::read_text;

TEST(MapPly, ContainsEveryLandmark) {
  ExportedMap map(synthetic::default_rig());
  map.colours.of.front() = {1, 2, 200};
  const std::string ply = landmarks_ply(map.selection, map.colours);
  const std::size_t begin = ply.find("end_header\n") + 11;
  EXPECT_NE(ply.find("element vertex " + std::to_string(map.selection.landmarks.size()) + "\n"), std::string::npos);
  ASSERT_EQ(ply.size() - begin, map.selection.landmarks.size() * (3 * 8 + 3 + 4));
  Eigen::Vector3d first;
  std::memcpy(first.data(), ply.data() + begin, 24);
  EXPECT_EQ(first, map.map.landmark(map.selection.landmarks.front()).position);
  EXPECT_EQ(ply.substr(begin + 24, 3), "\x01\x02\xc8");
}

// Projects the landmarks as nerfstudio does: x right, y up, looking along -z, origin at the corner of the first pixel.
TEST(Nerfstudio, LandmarksProjectToTheirKeypoints) {
  const camera::Intrinsics k{300, 301, 375.5, 239.5};
  const ExportedMap map(with_models(synthetic::ring_rig(2), {camera::Pinhole(k)}));
  const std::vector<std::string> paths(map.images.images().size(), "an image.png");
  const auto json =
      nlohmann::json::parse(nerfstudio_json(map.selection, map.images, map.cameras, paths, "points.ply").value());
  EXPECT_EQ(json["camera_model"], "OPENCV");
  EXPECT_EQ(json["ply_file_path"], "points.ply");
  ASSERT_EQ(json["frames"].size(), map.images.images().size());
  std::size_t close = 0, all = 0;
  for (const LandmarkId l : map.selection.landmarks) {
    const Eigen::Vector3d p = map.selection.T_upright_world * map.map.landmark(l).position;
    for_each_keypoint(map.selection, l, [&](KeyframeId keyframe, frame::KeypointRef r) {
      const auto& frame = json["frames"][static_cast<std::size_t>(map.images.of(keyframe, r.camera.index()))];
      Eigen::Matrix4d T;
      for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) T(row, column) = frame["transform_matrix"][row][column];
      const Eigen::Vector3d q = (T.inverse() * p.homogeneous()).head<3>();
      const Eigen::Vector2d pixel(frame["fl_x"].get<double>() * q.x() / -q.z() + frame["cx"].get<double>(),
                                  frame["fl_y"].get<double>() * -q.y() / -q.z() + frame["cy"].get<double>());
      const auto expected = map.map.rig().camera(r.camera).project(map.map.cam_from_world(keyframe, r.camera) *
                                                                   map.map.landmark(l).position);
      ++all;
      if (expected) close += (pixel - *expected - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-6;
    });
  }
  EXPECT_GT(all, 500u);
  EXPECT_GT(close, all * 9 / 10);
}

TEST(Nerfstudio, HasOneKindOfCameraPerDataSet) {
  const camera::Intrinsics k{300, 301, 375.5, 239.5};
  const auto result = [&](const std::vector<camera::CameraModel>& models, bool undistort) {
    const ExportedMap map(with_models(synthetic::ring_rig(2), models), undistort);
    const std::vector<std::string> paths(map.images.images().size(), "i.png");
    return nerfstudio_json(map.selection, map.images, map.cameras, paths, "points.ply");
  };
  const camera::KannalaBrandt fisheye(k, {0.1, 0.2, 0.3, 0.4});
  const auto json = nlohmann::json::parse(result({fisheye}, false).value());
  EXPECT_EQ(json["camera_model"], "OPENCV_FISHEYE");
  EXPECT_EQ(json["frames"][0]["k4"], 0.4);
  EXPECT_TRUE(result({camera::Pinhole(k), camera::PinholeRadTan(k, {0.1, 0.2, 0.3, 0.4})}, false));
  EXPECT_FALSE(result({camera::Pinhole(k), fisheye}, false));
  EXPECT_FALSE(result({camera::Unified(k, 0.5)}, false));
  EXPECT_TRUE(result({camera::Pinhole(k), camera::Unified(k, 0.5)}, true));
}

// The undistorted image of a pattern of directions shows the same directions through the pinhole.
TEST(OutputCameras, UndistortedImagesAreFilledAndShowTheSameDirections) {
  const camera::Intrinsics k{220, 221, 160, 118};
  for (const camera::CameraModel& model :
       {camera::CameraModel(camera::KannalaBrandt(k, {0.01, -0.002, 0.001, 0})),
        camera::CameraModel(camera::PinholeRadTan(k, {-0.2, 0.05, 0.001, -0.001})),
        camera::CameraModel(camera::PinholeRadTan(k, {0.1, 0.01, 0, 0})),
        camera::CameraModel(camera::DoubleSphere({150, 150, 160, 118}, 0.1, 0.55))}) {
    const camera::Rig ring = synthetic::ring_rig(1);
    camera::Camera camera = ring.camera(0);
    camera.model = model;
    camera.width = 320;
    camera.height = 240;
    const camera::Rig rig({{camera, ring.body_from_cam(0)}});
    const auto value = [](const Eigen::Vector3d& ray) { return 128 + 60 * std::sin(6 * ray.x() / ray.norm()); };
    cv::Mat recorded(240, 320, CV_8UC3, cv::Scalar::all(0));
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 320; ++x)
        if (const auto ray = camera.unproject({x, y}))
          recorded.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<uchar>(value(*ray)));
    OutputCameras cameras(rig, true);
    const cv::Mat image = cameras.image(0, recorded);
    ASSERT_EQ(image.size(), recorded.size());
    double largest = 0;
    for (int y = 1; y < 239; ++y)
      for (int x = 1; x < 319; ++x) {
        const Eigen::Vector3d ray = cameras.camera(0).unproject({x, y}).value();
        largest = std::max(largest, std::abs(image.at<cv::Vec3b>(y, x)[0] - value(ray)));
      }
    EXPECT_LT(largest, 4) << camera::model_name(model);
    const auto pixel = cameras.pixel(0, {170, 100});
    ASSERT_TRUE(pixel);
    const Eigen::Vector3d a = cameras.camera(0).unproject(*pixel).value(), b = camera.unproject({170, 100}).value();
    EXPECT_LT((a.normalized() - b.normalized()).norm(), 1e-6);
    EXPECT_FALSE(cameras.pixel(0, {0, 0}) && cameras.pixel(0, {319, 239}) && cameras.pixel(0, {0, 239}) &&
                 cameras.pixel(0, {319, 0}));
  }
}

// A recording whose images have one colour per camera, as the folder `data`.
class MapExportFiles : public testing::Test {
 protected:
  MapExportFiles() : map_(storage::small_map(synthetic::ring_rig(2))) {
    selection_ = select_submap(map_, 0).value();
    data_.name = "data";
    std::vector<camera::RigCamera> cameras;
    for (std::size_t c = 0; c < 2; ++c) cameras.push_back({map_.rig().camera(c), map_.rig().body_from_cam(c)});
    data_.rig = camera::Rig(cameras);
    data_.pixel_formats.resize(2);
    for (const KeyframeId k : selection_.keyframes) {
      dataset::FrameEntry entry{map_.keyframe(k).frame->time_ns, {{}, {}}};
      for (std::size_t c = 0; c < 2; ++c) {
        const TimeNs time_ns = map_.keyframe(k).frame->cameras[c].time_ns;
        const fs::path file = root() / (c == 0 ? "left" : "right") / (std::to_string(time_ns) + ".jpg");
        fs::create_directories(file.parent_path());
        const camera::Camera& camera = map_.rig().camera(c);
        const cv::Mat image(camera.height, camera.width, CV_8UC3,
                            c == 0 ? cv::Scalar(0, 0, 255) : cv::Scalar(255, 0, 0));
        if (!fs::exists(file)) cv::imwrite(file.string(), image);
        entry.images[c] = image_files::ImageFile{file, time_ns};
      }
      data_.frames.push_back(entry);
    }
  }
  fs::path root() const { return folder_.path() / "data"; }
  ExportRequest request(Format format, const std::string& out) const {
    ExportRequest request;
    request.format = format;
    request.out = folder_.path() / out;
    request.data = &data_;
    request.data_folder = root();
    return request;
  }

  support::TemporaryFolder folder_;
  map::BundledMap map_;
  Selection selection_;
  dataset::Dataset data_{"", dataset::DatasetFormat::kFolder, synthetic::ring_rig(2), {0, 1}, {}, 0, {}, {}, {}};
};

TEST_F(MapExportFiles, NamesAndColoursAreThoseOfTheImages) {
  const auto report = export_map(map_, request(Format::kColmap, "colmap"));
  ASSERT_TRUE(report) << report.error().message();
  std::istringstream images(read_text(folder_.path() / "colmap/images.txt"));
  std::size_t named = 0;
  for (std::string word; images >> word;)
    if (word.ends_with(".jpg")) named += fs::exists(root() / word);
  EXPECT_EQ(named, ImageTable(selection_, nullptr, {}).images().size());
  // The mean over the observations: red of those by the left camera, blue of those by the right one.
  std::istringstream points(read_text(folder_.path() / "colmap/points3D.txt"));
  std::size_t checked = 0;
  for (std::string line; std::getline(points, line);) {
    if (line.starts_with("#")) continue;
    int id = 0;
    double x = 0, r = 0, g = 0, b = 0;
    std::istringstream(line) >> id >> x >> x >> x >> r >> g >> b;
    Eigen::Vector2d seen(0, 0);
    for_each_keypoint(selection_, LandmarkId(id - 1),
                      [&](KeyframeId, frame::KeypointRef k) { ++seen[k.camera.value()]; });
    EXPECT_NEAR(r, 255 * seen[0] / seen.sum(), 3) << line;
    EXPECT_NEAR(b, 255 * seen[1] / seen.sum(), 3) << line;
    EXPECT_LT(g, 3);
    ++checked;
  }
  EXPECT_EQ(checked, selection_.landmarks.size());
}

TEST_F(MapExportFiles, UndistortedImagesAndTheirCalibrationAreBesideTheModel) {
  ExportRequest undistort = request(Format::kNerfstudio, "nerf");
  undistort.undistort = true;
  const auto report = export_map(map_, undistort);
  ASSERT_TRUE(report) << report.error().message();
  const auto json = nlohmann::json::parse(read_text(folder_.path() / "nerf/transforms.json"));
  for (const auto& frame : json["frames"]) {
    const cv::Mat image = cv::imread((folder_.path() / "nerf" / frame["file_path"].get<std::string>()).string());
    ASSERT_EQ(image.cols, frame["w"]);
    EXPECT_EQ(image.rows, frame["h"]);
    EXPECT_EQ(frame["k1"], 0.0);
  }
  const auto rig = rig_formats::read_rig(folder_.path() / "nerf/rig.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(camera::model_name(rig->camera(0).model), "pinhole");
  EXPECT_EQ(camera::intrinsics(rig->camera(0).model).fx, json["frames"][0]["fl_x"]);
}

// The names of the images of a model of COLMAP.
std::vector<std::string> names_in(const fs::path& images_txt) {
  std::istringstream file(read_text(images_txt));
  std::vector<std::string> names;
  for (std::string word; file >> word;)
    if (word.ends_with(".png") || word.ends_with(".jpg")) names.push_back(word);
  return names;
}

TEST_F(MapExportFiles, ModelsOfUndistortedImagesContainTheWrittenOnesOnly) {
  const std::size_t all = ImageTable(selection_, nullptr, {}).images().size();
  data_.frames.front().images[0] = std::nullopt;  // not in the recording
  support::write_text(data_.frames[1].images[1]->path, "damaged");
  ExportRequest undistort = request(Format::kColmap, "colmap");
  undistort.undistort = true;
  const auto report = export_map(map_, undistort);
  ASSERT_TRUE(report) << report.error().message();
  for (const char* const text : {"; they are left out", "images could not be read; they are left out"})
    EXPECT_TRUE(std::ranges::any_of(report->notes, [&](const std::string& n) { return n.ends_with(text); })) << text;
  const std::vector<std::string> names = names_in(folder_.path() / "colmap/images.txt");
  EXPECT_EQ(names.size(), all - 2);
  for (const std::string& name : names) EXPECT_TRUE(fs::exists(folder_.path() / "colmap/images" / name)) << name;
  undistort.format = Format::kNerfstudio;
  undistort.out = folder_.path() / "nerf";
  ASSERT_TRUE(export_map(map_, undistort));
  const auto json = nlohmann::json::parse(read_text(folder_.path() / "nerf/transforms.json"));
  EXPECT_EQ(json["frames"].size(), all - 2);
  for (const auto& frame : json["frames"])
    EXPECT_TRUE(fs::exists(folder_.path() / "nerf" / frame["file_path"].get<std::string>())) << frame["file_path"];
  fs::remove_all(root());
  undistort.overwrite = true;
  const auto unreadable = export_map(map_, undistort);
  ASSERT_FALSE(unreadable);
  EXPECT_EQ(unreadable.error().found, "no image of the map that can be read");
}

TEST_F(MapExportFiles, PathsOfNerfstudioLeadFromItsFolderToTheRecording) {
  fs::create_directories(folder_.path() / "elsewhere/deep/target");
  fs::create_directory_symlink(folder_.path() / "elsewhere/deep/target", folder_.path() / "link");
  fs::create_directory_symlink(folder_.path() / "elsewhere/deep", folder_.path() / "above");
  for (const char* const out : {"nerf", "link", "above/nerf"}) {
    ASSERT_TRUE(export_map(map_, request(Format::kNerfstudio, out))) << out;
    const auto json = nlohmann::json::parse(read_text(folder_.path() / out / "transforms.json"));
    for (const auto& frame : json["frames"])
      EXPECT_TRUE(fs::exists(folder_.path() / out / frame["file_path"].get<std::string>())) << frame["file_path"];
  }
}

// The images of a recording in one file, such as a bag: here the files of the folder.
class StoredFiles : public image_files::ImageStore {
 public:
  std::int64_t add(const fs::path& file) {
    files_.push_back(file);
    return static_cast<std::int64_t>(files_.size() - 1);
  }
  Result<image_files::StoredImage> read(std::int64_t entry) const override {
    image_files::StoredImage stored{read_text(files_.at(static_cast<std::size_t>(entry)))};
    stored.size = stored.bytes.size();
    return stored;
  }
  std::string name(std::int64_t) const override { return "image"; }
  std::string source(std::int64_t) const override { return "bag"; }
  std::string stream(std::int64_t) const override { return "topic"; }

 private:
  std::vector<fs::path> files_;
};

TEST_F(MapExportFiles, ImagesInsideOfARecordingGiveColoursAndUndistortedFiles) {
  const auto store = std::make_shared<StoredFiles>();
  for (dataset::FrameEntry& frame : data_.frames)
    for (auto& image : frame.images) {
      image->entry = store->add(image->path);
      image->store = store;
      image->path.clear();
    }
  const auto noted = export_map(map_, request(Format::kPly, "map.ply"));
  ASSERT_TRUE(noted) << noted.error().message();
  for (const std::string& note : noted->notes)
    EXPECT_TRUE(note.find("grey") == note.npos && note.find("could not be read") == note.npos) << note;
  ExportRequest undistort = request(Format::kColmap, "colmap");
  undistort.undistort = true;
  ASSERT_TRUE(export_map(map_, undistort));
  std::istringstream images(read_text(folder_.path() / "colmap/images.txt"));
  std::size_t named = 0;
  for (std::string word; images >> word;)
    if (word.ends_with(".png")) named += fs::exists(folder_.path() / "colmap/images" / word);
  EXPECT_EQ(named, ImageTable(selection_, nullptr, {}).images().size());
}

// A recording during whose reading the user interrupts the program.
class InterruptedFiles : public StoredFiles {
 public:
  Result<image_files::StoredImage> read(std::int64_t entry) const override {
    if (++reads == last) source.request_stop();
    return StoredFiles::read(entry);
  }
  mutable std::stop_source source;
  std::size_t last = 0;  // number of the read at which a stop is requested
  mutable std::size_t reads = 0;
};

TEST_F(MapExportFiles, AnInterruptedExportEndsBeforeTheNextImageAndLeavesNothing) {
  const std::size_t all = ImageTable(selection_, nullptr, {}).images().size();
  const std::size_t compared = std::min<std::size_t>(all, 12);  // whether they show the keypoints of their keyframes
  // while images are compared, and read for the colours, and for the undistorted images
  for (const std::size_t last : {std::size_t{2}, compared + 2, compared + all + 2}) {
    const auto store = std::make_shared<InterruptedFiles>();
    store->last = last;
    dataset::Dataset data = data_;
    for (dataset::FrameEntry& frame : data.frames)
      for (auto& image : frame.images)
        image = image_files::ImageFile{
            .path = {}, .time_ns = image->time_ns, .store = store, .entry = store->add(image->path)};
    ExportRequest undistort = request(Format::kColmap, "colmap");
    undistort.undistort = true;
    undistort.data = &data;
    undistort.interrupted = store->source.get_token();
    const auto report = export_map(map_, undistort);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().message(), "interrupted; nothing is written");
    EXPECT_EQ(store->reads, last);
    for (const auto& entry : fs::directory_iterator(folder_.path())) EXPECT_EQ(entry.path(), root());
  }
  std::stop_source source;
  source.request_stop();
  for (const FormatName& format : formats()) {
    ExportRequest plain = request(format.format, std::string(format.name));
    plain.interrupted = source.get_token();
    EXPECT_FALSE(export_map(map_, plain)) << format.name;
    EXPECT_FALSE(fs::exists(plain.out)) << format.name;
  }
}

// The same cameras mounted differently are another rig of the map, whose names are taken: they become cam2 and cam3.
TEST_F(MapExportFiles, TheRecordingOfAnAppendedRigIsFound) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < 2; ++c) cameras.push_back({map_.rig().camera(c), map_.rig().body_from_cam(c)});
  cameras[1].T_body_cam = cameras[1].T_body_cam * geometry::SE3(geometry::Matrix3d::Identity(), {0.1, 0, 0});
  const camera::Rig other(std::move(cameras));
  const std::size_t first = map::find_or_append_rig(map_, other);
  ASSERT_EQ(first, 2u);
  frame::BundledFrame frame = *map_.keyframe(selection_.keyframes.back()).frame;
  std::swap(frame.cameras[0], frame.cameras[2]);
  std::swap(frame.cameras[1], frame.cameras[3]);
  for (std::size_t c = 2; c < 4; ++c) frame.cameras[c].time_ns += 50'000'000;
  frame.bundled = {};
  const KeyframeId added =
      map_.add_keyframe(std::make_shared<const frame::BundledFrame>(std::move(frame)),
                        map_.keyframe(selection_.keyframes.back()).T_rig_world, {}, selection_.keyframes.back());
  // Recordings of both rigs, with images at the same times.
  const auto recording = [&](const camera::Rig& rig, const std::string& folder) {
    dataset::Dataset data{"", dataset::DatasetFormat::kFolder, rig, {0, 1}, {}, 0, {}, {}, {}};
    for (const TimeNs shift_ns : {TimeNs{0}, TimeNs{50'000'000}}) {
      dataset::FrameEntry entry;
      for (std::size_t c = 0; c < 2; ++c) {
        const TimeNs time_ns = map_.keyframe(added).frame->cameras[first + c].time_ns - 50'000'000 + shift_ns;
        entry.images.push_back(image_files::ImageFile{root() / folder / std::to_string(c), time_ns});
      }
      data.frames.push_back(entry);
    }
    return data;
  };
  const Selection selection = select_submap(map_, 0).value();
  const dataset::Dataset of_first = recording(map_.rig().subset(std::array{0, 1}), "first");
  const dataset::Dataset of_second = recording(other, "second");
  for (const auto& [data, folder, own] :
       {std::tuple(&of_first, "first/", std::size_t{0}), {&of_second, "second/", first}}) {
    const ImageTable images(selection, data, root());
    EXPECT_EQ(images.found(), 2u) << folder;
    for (const MapImage& image : images.images()) {
      if (!image.recorded) continue;
      EXPECT_EQ(image.name, folder + std::to_string(image.camera - own));
      EXPECT_EQ(image.keyframe == added, own == first);
    }
  }
}

// A run with one camera of a recording, continued by a run with another one: two rigs, whose cameras may be alike.
TEST_F(MapExportFiles, AllRigsOfARecordingFindTheirImagesAndAreRigsOfColmap) {
  const camera::Rig rig = synthetic::ring_rig(2);
  map::BundledMap map = storage::small_map(rig.subset(std::array{0}));
  ASSERT_EQ(map::find_or_append_rig(map, rig.subset(std::array{1})), 1u);
  const KeyframeId last = select_submap(map, 0).value().keyframes.back();
  frame::BundledFrame frame = *map.keyframe(last).frame;
  std::swap(frame.cameras[0], frame.cameras[1]);
  frame.bundled = frame::Bundled(std::array<std::size_t, 2>{0, frame.cameras[1].keypoints.size()}, {}, {});
  map.add_keyframe(std::make_shared<const frame::BundledFrame>(std::move(frame)), map.keyframe(last).T_rig_world, {},
                   last);
  const Selection selection = select_submap(map, 0).value();
  const ImageTable images(selection, &data_, root());
  EXPECT_EQ(images.found(), images.images().size());
  std::size_t right = 0;
  for (const MapImage& image : images.images()) {
    EXPECT_TRUE(image.name.starts_with(image.camera == 0 ? "left/" : "right/")) << image.name;
    right += image.camera;
  }
  EXPECT_EQ(right, 1u);
  const OutputCameras cameras(map.rig(), false);
  const auto model = colmap_model(selection, images, cameras, landmark_colours(selection, images));
  ASSERT_TRUE(model) << model.error().message();
  EXPECT_TRUE(model->rigs.ends_with("\n1 1 CAMERA 1\n2 1 CAMERA 2\n")) << model->rigs;
  EXPECT_NE(model->frames.find(fmt::format("\n{} 2 ", map.keyframe_slots())), std::string::npos) << model->frames;
}

TEST_F(MapExportFiles, NamesFromFilesCannotLeadOutOfTheFolderOrBreakLines) {
  std::vector<camera::RigCamera> cameras;
  for (const char* name : {"../../x", "/abs\n1 2 3", "..", ".._.._x"}) {
    camera::Camera camera = synthetic::ring_rig(4).camera(cameras.size());
    camera.name = name;
    cameras.push_back({camera, synthetic::ring_rig(4).body_from_cam(cameras.size())});
  }
  const ExportedMap map((camera::Rig(std::move(cameras))));
  std::set<std::string> folders;
  for (const MapImage& image : map.images.images()) folders.insert(fs::path(image.name).parent_path().string());
  EXPECT_EQ(folders, (std::set<std::string>{".._.._x", "_abs_1 2 3", "cam2", ".._.._x_2"}));
  // A list of images in a recording.
  for (dataset::FrameEntry& frame : data_.frames)
    for (auto& image : frame.images)
      image->path = root() / ("../data/" + image->path.lexically_relative(root()).string() + "\n/../../../../up\n.jpg");
  ImageTable images(selection_, &data_, root());
  ASSERT_EQ(images.found(), images.images().size());
  for (const MapImage& image : images.images()) EXPECT_EQ(image.name.find('\n'), std::string::npos);
  images.set_extensions(".png");
  std::set<std::string> names;
  for (const MapImage& image : images.images()) {
    EXPECT_TRUE(image.name.starts_with("_/_/up_") && image.name.ends_with(".png")) << image.name;
    names.insert(image.name);
  }
  EXPECT_EQ(names.size(), images.images().size());
}

// A run corrects the capture times of images whose stamps are wrong.
TEST_F(MapExportFiles, ImagesWithCorrectedCaptureTimesAreFound) {
  for (const KeyframeId k : selection_.keyframes) map_.correct_time({k, CameraIndex(1), 4'000'000});
  const ImageTable images(selection_, &data_, root());
  EXPECT_EQ(images.found(), images.images().size());
  for (dataset::FrameEntry& frame : data_.frames) frame.images[1]->time_ns += 30'000'000;
  EXPECT_EQ(ImageTable(selection_, &data_, root()).found(), images.images().size() / 2);
}

TEST_F(MapExportFiles, ARecordingWithoutTheImagesIsAnError) {
  for (dataset::FrameEntry& frame : data_.frames)
    for (auto& image : frame.images) image->time_ns += 5'000'000;
  const auto report = export_map(map_, request(Format::kColmap, "colmap"));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().key, "--images");
  EXPECT_FALSE(fs::exists(folder_.path() / "colmap"));
}

TEST_F(MapExportFiles, EveryFormatIsWrittenCompletelyOrNotAtAll) {
  for (const FormatName& format : formats()) {
    ExportRequest plain = request(format.format, std::string(format.name));
    plain.data = nullptr;
    const auto report = export_map(map_, plain);
    ASSERT_TRUE(report) << format.name << ": " << report.error().message();
    EXPECT_EQ(fs::is_directory(plain.out), format.is_folder);
    EXPECT_FALSE(export_map(map_, plain)) << format.name << " without --overwrite";
    plain.overwrite = true;
    EXPECT_TRUE(export_map(map_, plain)) << format.name;
    plain.out = "/no/such/folder/" + std::string(format.name);
    if (!format.is_folder) {
      EXPECT_FALSE(export_map(map_, plain)) << format.name;
    }
  }
  std::size_t entries = 0;
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    ++entries;
    EXPECT_EQ(entry.path().string().find(".part-"), std::string::npos) << entry.path();
  }
  EXPECT_EQ(entries, formats().size() + 1);
}

TEST_F(MapExportFiles, OptionsThatDoNotFitTheFormatAreErrors) {
  ExportRequest wrong = request(Format::kPly, "map.ply");
  wrong.undistort = true;
  EXPECT_EQ(export_map(map_, wrong).error().key, "--undistort");
  wrong = request(Format::kG2o, "map.g2o");
  wrong.resolution = 0.1;
  EXPECT_FALSE(export_map(map_, wrong));
  wrong = request(Format::kColmap, "colmap");
  wrong.undistort = true;
  wrong.data = nullptr;
  EXPECT_FALSE(export_map(map_, wrong));
  EXPECT_FALSE(export_map(map::BundledMap(map_.shared_rig()), request(Format::kG2o, "empty.g2o")));
}

TEST_F(MapExportFiles, SubmapsAreExportedOneByOne) {
  ExportRequest plain = request(Format::kG2o, "map.g2o");
  plain.data = nullptr;
  const auto report = export_map(map_, plain);
  ASSERT_TRUE(report);
  EXPECT_TRUE(std::ranges::any_of(report->notes, [](const std::string& n) { return n.find("2 submaps") != n.npos; }));
  plain.submap = 1;
  plain.out = folder_.path() / "second.g2o";
  ASSERT_TRUE(export_map(map_, plain));
  EXPECT_LT(fs::file_size(plain.out), fs::file_size(folder_.path() / "map.g2o"));
}

}  // namespace
}  // namespace bslam::map_export
