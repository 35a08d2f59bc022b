#include "capture/live_cameras.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "capture/pixels.h"
#include "capture/played_folders.h"
#include "dataset/frame_reader.h"
#include "image_decoding/image_file.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::capture {
namespace {

using std::chrono::milliseconds;

constexpr TimeNs kStart = 1'700'000'000'000'000'000, kInterval = 50'000'000, kMs = 1'000'000;

struct Event {
  enum class Kind { kImage, kDamaged, kNone, kLost, kOpens, kDoesNotOpen, kOpensAnother, kOpensWiderRows, kGate } kind;
  std::size_t camera;
  TimeNs time_ns = 0;
};

// What happens to the cameras, one thing after the other: each waits for its turn, and has done with an event when it
// asks for the next one. After the last one all cameras end.
class Script {
 public:
  explicit Script(std::vector<Event> events) : events_(std::move(events)) {}

  // Waits for the next event of a camera, for a while.
  struct Turn {
    std::optional<Event> event = {};
    bool end = false;
  };
  Turn next(std::size_t camera) {
    std::unique_lock lock(mutex_);
    if (busy_ == camera) {
      busy_.reset();
      ++at_;
      changed_.notify_all();
    }
    const bool came = changed_.wait_for(lock, milliseconds(20), [&] {
      return !busy_ && (at_ >= events_.size() ||
                        (events_[at_].camera == camera && (events_[at_].kind != Event::Kind::kGate || gates_ > 0)));
    });
    if (!came) return {};
    if (at_ >= events_.size()) return {.end = true};
    if (events_[at_].kind == Event::Kind::kGate) --gates_;
    busy_ = camera;
    return {.event = events_[at_]};
  }
  // Lets the script pass its next gate.
  void open_gate() {
    const std::lock_guard lock(mutex_);
    ++gates_;
    changed_.notify_all();
  }
  void device_ended() {
    const std::lock_guard lock(mutex_);
    ++ended_;
    changed_.notify_all();
  }
  void wait_for_ends(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ended_ >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  const std::vector<Event> events_;
  std::size_t at_ = 0;
  std::optional<std::size_t> busy_;  // the camera that deals with the event
  int gates_ = 0, ended_ = 0;
};

// Camera 0 delivers grey pixels, camera 1 JPEG files.
class ScriptedDevice : public Device {
 public:
  ScriptedDevice(std::shared_ptr<Script> script, std::size_t camera, Event::Kind opened, std::optional<double> fps)
      : script_(std::move(script)), camera_(camera), opened_(opened), fps_(fps) {}
  ~ScriptedDevice() override { script_->device_ended(); }

  Result<Stream> start(const StreamRequest& request) override {
    image_.create(request.height, request.width + (opened_ == Event::Kind::kOpensWiderRows ? 8 : 0), CV_8UC1);
    return Stream{.pixels = camera_ == 0 ? fourcc("GREY") : fourcc("MJPG"),
                  .width = request.width,
                  .height = request.height,
                  .step = camera_ == 0 ? static_cast<std::size_t>(image_.cols) : 0,
                  .fps = fps_,
                  .identity = opened_ == Event::Kind::kOpensAnother ? "another at usb-2" : "camera at usb-2"};
  }
  Result<DeviceImage> read(milliseconds) override {
    const auto [event, end] = script_->next(camera_);
    if (end) return DeviceImage{.state = DeviceImage::State::kEnd};
    if (!event) return DeviceImage{};
    if (event->kind == Event::Kind::kLost) return Error{"", "", "a camera that was unplugged", ""};
    if (event->kind == Event::Kind::kDamaged) return DeviceImage{.state = DeviceImage::State::kDamaged};
    if (event->kind != Event::Kind::kImage) return DeviceImage{};
    for (int k = 0; k < image_.rows * image_.cols; ++k)
      image_.data[k] = static_cast<std::uint8_t>(event->time_ns / kMs + k);
    bytes_.assign(image_.data, image_.data + image_.rows * image_.cols);
    if (camera_ == 1) cv::imencode(".jpg", image_, bytes_);
    const std::string_view view(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    return DeviceImage{DeviceImage::State::kImage, view, event->time_ns};
  }

 private:
  const std::shared_ptr<Script> script_;
  const std::size_t camera_;
  const Event::Kind opened_;
  const std::optional<double> fps_;
  cv::Mat image_;
  std::vector<std::uint8_t> bytes_;
};

// Two cameras, the time stamps of the second with an offset in the rig file.
camera::Rig test_rig() {
  const camera::Rig ring = synthetic::ring_rig(2, 64);
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < 2; ++c) cameras.push_back({ring.camera(c), ring.body_from_cam(c)});
  cameras[1].camera.time_offset_ns = 3 * kMs;
  return camera::Rig(std::move(cameras));
}

class LiveCamerasTest : public testing::Test {
 protected:
  std::unique_ptr<LiveCameras> open(std::vector<Event> events, std::size_t max_waiting = 1000) {
    script_ = std::make_shared<Script>(std::move(events));
    LiveOptions options{.paths = {"a", "b"}, .request = {}, .open = opener()};
    options.retry = milliseconds(0);
    options.max_waiting = max_waiting;
    options.silence = silence_;
    options.say = [this](const std::string& line) { said_.push_back(line); };
    auto live = LiveCameras::open(rig_, std::move(options));
    EXPECT_TRUE(live.ok()) << live.error().message();
    return *std::move(live);
  }
  OpenDevice opener() {
    return [this, first = std::make_shared<int>(0)](const std::string& path) -> Result<std::unique_ptr<Device>> {
      const std::size_t camera = path == "a" ? 0 : 1;
      Event::Kind opened = Event::Kind::kOpens;
      if ((*first)++ >= 2) {  // again
        const auto [event, end] = script_->next(camera);
        if (!event || event->kind == Event::Kind::kDoesNotOpen) return Error{path, "", "no such camera", "a camera"};
        opened = event->kind;
      }
      return std::unique_ptr<Device>(std::make_unique<ScriptedDevice>(script_, camera, opened, fps_));
    };
  }
  // All frames until the end.
  static std::vector<session::FrameSource::Item> all(LiveCameras& live) {
    std::vector<session::FrameSource::Item> out;
    while (auto item = live.next()) out.push_back(*std::move(item));
    return out;
  }
  // Images of both cameras from frame `from` to before `to`.
  static void add_frames(std::vector<Event>& events, int from, int to) {
    for (int k = from; k < to; ++k) {
      events.push_back({Event::Kind::kImage, 0, kStart + k * kInterval});
      events.push_back({Event::Kind::kImage, 1, kStart + k * kInterval - 3 * kMs});
    }
  }

  const camera::Rig rig_ = test_rig();
  std::shared_ptr<Script> script_;
  std::optional<double> fps_;
  milliseconds silence_{2000};
  std::vector<std::string> said_;
};

// Images are missing, damaged, repeated, and have wrong times; the gate keeps frames waiting until they are asked for.
std::vector<Event> eventful() {
  using Kind = Event::Kind;
  std::vector<Event> events{{Kind::kImage, 0, kStart - 10 * kInterval}, {Kind::kImage, 1, kStart - 10 * kInterval}};
  for (int k = -9; k < -5; ++k) {
    events.push_back({Kind::kImage, 0, kStart + k * kInterval});
    events.push_back({Kind::kImage, 1, kStart + k * kInterval - 3 * kMs});
  }
  events.push_back({Kind::kGate, 0});
  for (int k = 0; k < 40; ++k) {
    const TimeNs jitter_ns = (k * 7 % 5 - 2) * kMs / 3;
    if (k % 9 == 4) events.push_back({Kind::kDamaged, 0});
    if (k % 9 != 4) events.push_back({Kind::kImage, 0, kStart + k * kInterval});
    if (k == 20) events.push_back({Kind::kImage, 0, kStart + k * kInterval});          // again
    if (k == 25) events.push_back({Kind::kImage, 0, kStart + 5 * kInterval});          // back
    if (k == 30) events.push_back({Kind::kImage, 1, kStart + 1'000'000 * kInterval});  // far ahead
    if (k % 7 != 3) events.push_back({Kind::kImage, 1, kStart + k * kInterval - 3 * kMs + jitter_ns});
    if (k % 5 == 0) events.push_back({Kind::kNone, 1});
  }
  return events;
}

TEST_F(LiveCamerasTest, RecordingHasTheSameFrames) {
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "live.mcap";
  auto live = open(eventful());
  const auto first_ns = live->wait_for_first_frame();
  ASSERT_TRUE(first_ns.ok()) << first_ns.error().message();
  auto recorder = Recorder::create(file, rig_, {0, 1}, {false, true});
  ASSERT_TRUE(recorder.ok());
  live->record_to(recorder->get());
  live->begin();
  script_->open_gate();
  const auto fed = all(*live);
  ASSERT_TRUE((*recorder)->finish().ok());
  ASSERT_GE(fed.size(), 35u);
  EXPECT_EQ((*recorder)->frames(), fed.size());

  const auto data = dataset::open_dataset({.path = file});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_TRUE(data->warnings.empty()) << data->warnings.front();
  ASSERT_EQ(data->frames.size(), fed.size());
  EXPECT_EQ(data->sources, (std::vector<std::string>{"/cam0/image_raw", "/cam1/image_raw/compressed"}));
  std::size_t missing = 0;
  for (std::size_t k = 0; k < fed.size(); ++k) {
    const image::ImageBundle again = dataset::read_frame(*data, k);
    EXPECT_EQ(again.id, fed[k].images.id);
    EXPECT_EQ(again.time_ns, fed[k].images.time_ns);
    EXPECT_FALSE(fed[k].dropped);
    for (std::size_t c = 0; c < 2; ++c) {
      const image::CameraImage &was = fed[k].images.images[c], &is = again.images[c];
      ASSERT_EQ(is.state, was.state);
      missing += was.state == image::ImageState::kMissing;
      if (was.state == image::ImageState::kMissing) continue;
      EXPECT_EQ(is.time_ns, was.time_ns);
      for (int y = 0; y < is.image.height(); ++y)
        EXPECT_TRUE(std::equal(is.image.row(y), is.image.row(y) + is.image.width(), was.image.row(y)));
    }
  }
  EXPECT_GE(missing, 8u);
}

// A recording can be run where the files of the masks are others, or do not exist.
TEST_F(LiveCamerasTest, RecordingHasTheMasksOfTheRig) {
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "live.mcap";
  camera::Camera masked = rig_.camera(std::size_t{1});
  masked.mask_file = (folder.path() / "mask.png").string();
  cv::Mat mask(masked.height, masked.width, CV_16UC1, cv::Scalar(3));
  mask.rowRange(0, 5) = 0;
  ASSERT_TRUE(cv::imwrite(masked.mask_file, mask));
  const camera::Rig rig({{rig_.camera(std::size_t{0}), rig_.body_from_cam(0)}, {masked, rig_.body_from_cam(1)}});
  auto live = open(eventful());
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  auto recorder = Recorder::create(file, rig, {0, 1}, {false, true});
  ASSERT_TRUE(recorder.ok()) << recorder.error().message();
  live->record_to(recorder->get());
  live->begin();
  script_->open_gate();
  all(*live);
  ASSERT_TRUE((*recorder)->finish().ok());
  support::write_image(masked.mask_file, masked.width, masked.height);  // another one
  const auto elsewhere = folder.path() / "elsewhere.mcap";
  std::filesystem::rename(file, elsewhere);
  const auto data = dataset::open_dataset({.path = elsewhere});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_TRUE(data->warnings.empty()) << data->warnings.front();
  EXPECT_EQ(data->rig.camera(std::size_t{1}).mask_file, (elsewhere / "masks/cam1.png").string());
  const auto masks = image_decoding::read_masks(data->rig);
  ASSERT_TRUE(masks.ok()) << masks.error().message();
  EXPECT_TRUE((*masks)[0].empty());
  for (int y = 0; y < masked.height; ++y) EXPECT_EQ((*masks)[1].row(y)[7] != 0, y >= 5) << y;
  std::filesystem::remove(masked.mask_file);
  EXPECT_FALSE(Recorder::create(file, rig, {0, 1}, {false, true}).ok());
}

TEST_F(LiveCamerasTest, RecordedRigIsThatOfTheRun) {
  const auto once = rig_as_recorded(rig_);
  ASSERT_TRUE(once.ok());
  const auto twice = rig_as_recorded(*once);
  ASSERT_TRUE(twice.ok());
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(once->body_from_cam(c).matrix(), twice->body_from_cam(c).matrix());
    EXPECT_LT((once->body_from_cam(c).matrix() - rig_.body_from_cam(c).matrix()).norm(), 1e-13);
    EXPECT_EQ(twice->camera(c).time_offset_ns, rig_.camera(c).time_offset_ns);
  }
}

TEST_F(LiveCamerasTest, RecordedRigHasTheRigFrameOfARefinedCalibration) {
  const geometry::SE3 T_cam0_rig(geometry::so3_exp({0, 0.01, 0}), geometry::Vector3d::Zero());
  const camera::Rig rig(
      {{rig_.camera(std::size_t{0}), rig_.body_from_cam(0)}, {rig_.camera(std::size_t{1}), rig_.body_from_cam(1)}},
      T_cam0_rig);
  const auto recorded = rig_as_recorded(rig);
  ASSERT_TRUE(recorded.ok());
  EXPECT_LT((recorded->cam_from_rig(0).matrix() - T_cam0_rig.matrix()).norm(), 1e-13);
}

TEST_F(LiveCamerasTest, TellsWhatWasNotUsed) {
  auto live = open(eventful());
  script_->open_gate();
  live->begin();
  all(*live);
  const std::vector<std::string> notes = live->notes();
  ASSERT_EQ(notes.size(), 3u);
  EXPECT_EQ(notes[0], "cam0 (a): 4 damaged images were not used");
  EXPECT_EQ(notes[1], "cam0 (a): 2 images were in no frame (1 duplicate, 1 too-late)");
  EXPECT_EQ(notes[2], "cam1 (b): 1 images were in no frame (1 far-ahead)");
  EXPECT_EQ(said_.size(), 4u);
}

TEST_F(LiveCamerasTest, CameraThatWasUnpluggedIsTakenUpAgain) {
  using Kind = Event::Kind;
  std::vector<Event> events;
  add_frames(events, 0, 10);
  events.push_back({Kind::kGate, 0});
  events.push_back({Kind::kLost, 1});
  for (int k = 10; k < 60; ++k) {
    events.push_back({Kind::kImage, 0, kStart + k * kInterval});
    if (k % 10 == 0) events.push_back({Kind::kDoesNotOpen, 1});
  }
  events.push_back({Kind::kOpens, 1});
  add_frames(events, 60, 80);
  auto live = open(std::move(events));
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  script_->open_gate();
  int both = 0, one = 0;
  for (const auto& item : all(*live)) {
    const bool there = item.images.images[1].state == image::ImageState::kPresent;
    EXPECT_EQ(item.images.images[0].state, image::ImageState::kPresent);
    both += there;
    one += !there;
  }
  EXPECT_EQ(one, 51);  // its first image comes when its frame is complete, since nothing was expected of it
  EXPECT_GE(both, 19);
  ASSERT_EQ(said_.size(), 3u);
  EXPECT_EQ(
      said_[0],
      "cam1 (b): a camera that was unplugged; the run goes on with the other cameras, and with this one when it is "
      "back");
  EXPECT_EQ(said_[1], "cam1 (b): images arrive again");
  EXPECT_EQ(said_[2],
            "cam1 (b): an image came too late for its frame, or its time stamp went back; it is not used, and further "
            "ones are counted");
  EXPECT_EQ(live->notes()[0], "cam1 (b): lost once");
}

// Without an image it is asked again and again, for longer than the silence of a camera that has delivered some.
TEST_F(LiveCamerasTest, ACameraMayTakeLongForItsFirstImage) {
  silence_ = milliseconds(0);
  std::vector<Event> events(3, Event{Event::Kind::kNone, 0});
  add_frames(events, 0, 1);
  const auto live = open(std::move(events));
  const auto first = live->wait_for_first_frame();
  ASSERT_TRUE(first.ok()) << first.error().message();
  EXPECT_TRUE(said_.empty()) << said_.front();
}

TEST_F(LiveCamerasTest, ASlowCameraIsNotLostBetweenItsImages) {
  silence_ = milliseconds(0);
  fps_ = 0.02;
  std::vector<Event> events;
  for (int k = 0; k < 5; ++k) {
    add_frames(events, k, k + 1);
    events.insert(events.end(), 3, Event{Event::Kind::kNone, 1});
  }
  auto live = open(std::move(events));
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  script_->wait_for_ends(2);
  EXPECT_TRUE(said_.empty()) << said_.front();
  EXPECT_TRUE(live->notes().empty());
}

TEST_F(LiveCamerasTest, NewestFramesWinAndDroppedOnesAreReported) {
  constexpr std::size_t kMaxWaiting = 3;
  std::vector<Event> events;
  add_frames(events, 0, 10);
  events.push_back({Event::Kind::kGate, 0});
  add_frames(events, 10, 40);
  auto live = open(std::move(events), kMaxWaiting);
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  script_->open_gate();
  script_->wait_for_ends(2);
  const auto items = all(*live);
  ASSERT_GE(items.size(), 30u);
  std::size_t taken = 0;
  for (std::size_t k = 0; k < items.size(); ++k) {
    EXPECT_EQ(items[k].images.time_ns, items[0].images.time_ns + static_cast<TimeNs>(k) * kInterval);
    EXPECT_EQ(items[k].dropped, k + kMaxWaiting < items.size());
    if (items[k].dropped) continue;
    EXPECT_EQ(items[k].images.id, FrameId(taken++));
    EXPECT_EQ(items[k].images.images.size(), 2u);
  }
  EXPECT_EQ(items.back().images.time_ns, kStart + 39 * kInterval);
}

// At a high rate, more frames wait until they span as long as a few frames of a usual rate.
TEST_F(LiveCamerasTest, FramesOfAHighRateWaitForATenthOfASecond) {
  constexpr int kFrames = 60;
  constexpr TimeNs kShort = 5 * kMs;
  std::vector<Event> events;
  add_frames(events, -1, 0);
  events.push_back({Event::Kind::kGate, 0});
  for (int k = 0; k < kFrames; ++k) {
    events.push_back({Event::Kind::kImage, 0, kStart + k * kShort});
    events.push_back({Event::Kind::kImage, 1, kStart + k * kShort - 3 * kMs});
  }
  auto live = open(std::move(events), 3);
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  script_->open_gate();
  script_->wait_for_ends(2);
  const auto items = all(*live);
  const auto processed = std::ranges::count(items, false, &session::FrameSource::Item::dropped);
  EXPECT_EQ(processed, 21);
  const auto first = std::ranges::find(items, false, &session::FrameSource::Item::dropped);
  ASSERT_NE(first, items.end());
  EXPECT_EQ(first->waiting, 20u);
  EXPECT_NEAR(first->waiting_s, 0.1, 1e-9);
}

TEST_F(LiveCamerasTest, LateImagesAreNotBlamedOnTheCameraWhileFramesWait) {
  std::vector<Event> events;
  add_frames(events, 0, 10);
  events.push_back({Event::Kind::kGate, 0});
  add_frames(events, 10, 40);
  events.push_back({Event::Kind::kImage, 0, kStart + 20 * kInterval + kMs});
  auto live = open(std::move(events), 3);
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  script_->open_gate();
  script_->wait_for_ends(2);
  ASSERT_EQ(said_.size(), 1u);
  EXPECT_EQ(said_[0],
            "cam0 (a): an image came too late for its frame, while the computer does not keep up; it is not used, and "
            "further ones are counted");
  EXPECT_EQ(live->notes(), std::vector<std::string>{"cam0 (a): 1 images were in no frame (1 too-late; 1 while the "
                                                    "computer did not keep up)"});
}

TEST_F(LiveCamerasTest, SaysWhichCameraDeliversNothing) {
  using Kind = Event::Kind;
  std::vector<Event> events;
  for (int k = 0; k < 10; ++k) events.push_back({Kind::kImage, 0, kStart + k * kInterval});
  for (int k = 0; k < 3; ++k) events.push_back({Kind::kDamaged, 1});
  events.push_back({Kind::kLost, 1});
  for (int k = 0; k < 100; ++k) events.push_back({Kind::kDoesNotOpen, 1});
  const auto live = open(std::move(events));
  const auto first = live->wait_for_first_frame();
  ASSERT_FALSE(first.ok());
  EXPECT_EQ(first.error().message(),
            "b: cam1: found a camera that was unplugged after 3 damaged images and no good one, "
            "expected images of this camera");
}

TEST_F(LiveCamerasTest, TheCameraThatWasLostIsBlamed) {
  using Kind = Event::Kind;
  std::vector<Event> events{{Kind::kImage, 1, kStart}, {Kind::kLost, 1}};
  for (int k = 0; k < 100; ++k) events.push_back({Kind::kDoesNotOpen, 1});
  const auto live = open(std::move(events));
  const auto first = live->wait_for_first_frame();
  ASSERT_FALSE(first.ok());
  EXPECT_EQ(first.error().message(), "b: cam1: found a camera that was unplugged, expected images of this camera");
}

TEST_F(LiveCamerasTest, AnotherCameraInPlaceOfALostOneIsNotUsed) {
  using Kind = Event::Kind;
  std::vector<Event> events;
  add_frames(events, 0, 10);
  for (const Kind kind : {Kind::kGate, Kind::kLost, Kind::kOpensAnother, Kind::kOpensAnother, Kind::kOpensWiderRows})
    events.push_back({kind, 0});
  add_frames(events, 10, 30);
  auto live = open(std::move(events));
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  script_->open_gate();
  const auto first_ns = live->wait_for_frame();
  const auto items = all(*live);
  ASSERT_FALSE(items.empty());
  EXPECT_EQ(first_ns, items.front().images.time_ns);
  EXPECT_EQ(items.back().images.images[0].state, image::ImageState::kPresent);
  ASSERT_GE(said_.size(), 3u);
  EXPECT_EQ(said_[1], "cam0 (a): found another at usb-2 in place of camera at usb-2; another camera is not used");
  EXPECT_EQ(said_[2], "cam0 (a): images arrive again");
  EXPECT_EQ(live->notes()[0], "cam0 (a): lost once");
}

// A pipe that nobody reads is a disk that hangs.
TEST(RecorderTest, WaitingForADiskThatHangsCanBeStopped) {
  const support::TemporaryFolder folder;
  const auto pipe = folder.path() / "live.mcap";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  const camera::Rig rig = synthetic::ring_rig(1, 512);
  auto recorder = Recorder::create(pipe, rig, {0}, {false});
  ASSERT_TRUE(recorder.ok()) << recorder.error().message();
  const auto pixels = std::make_shared<CapturedPixels>();
  std::mt19937 random(1);
  std::vector<std::uint8_t> noise(512 * 512);
  for (std::uint8_t& value : noise) value = static_cast<std::uint8_t>(random());
  const ImageBundle frame{{{noise.data(), 512, 512, 512, kStart, pixels}}};
  std::stop_source stop;
  stop.request_stop();
  int added = 0;
  while (added < 100'000 && (*recorder)->add(frame, stop.get_token())) ++added;
  EXPECT_GE(added, 32);
  EXPECT_LT(added, 100);
  std::signal(SIGPIPE, SIG_IGN);
  ::close(reader);
  EXPECT_FALSE((*recorder)->finish().ok());
}

TEST(PlayedFolders, GoOnWhereTheyWereAndReportImagesOfAnotherSize) {
  const support::TemporaryFolder folder;
  const std::string path = folder.path().string();
  for (const int k : {1, 2, 3}) support::write_image(folder.path() / fmt::format("{}.png", k), k == 2 ? 48 : 64, 32);
  const OpenDevice open = play_folders({path});
  TimeNs expected = 1;
  for (int opened = 0; opened < 3; ++opened) {
    auto device = *open(path);
    const auto stream = device->start({.width = 64, .height = 32});
    ASSERT_TRUE(stream.ok()) << stream.error().message();
    const auto image = device->read(milliseconds(1000));
    ASSERT_TRUE(image.ok());
    ASSERT_EQ(image->state, DeviceImage::State::kImage);
    EXPECT_EQ(image->time_ns, expected);
    EXPECT_EQ(grey_image(*stream, image->bytes).has_value(), expected != 2);
    ++expected;
  }
  EXPECT_EQ((*open(path))->read(milliseconds(0))->state, DeviceImage::State::kEnd);
}

TEST_F(LiveCamerasTest, StopEndsItWithWhatIsThere) {
  std::vector<Event> events;
  add_frames(events, 0, 1000);
  auto live = open(std::move(events));
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->begin();
  auto rest = std::async([&live] { return all(*live).size(); });
  live->stop();
  EXPECT_LE(rest.get(), 1000u);
  EXPECT_FALSE(live->next().has_value());
}

TEST_F(LiveCamerasTest, FailureOfTheDiskEndsTheRecordingOnly) {
  std::vector<Event> events;
  add_frames(events, 0, 10);
  events.push_back({Event::Kind::kGate, 0});
  add_frames(events, 10, 200);
  auto live = open(std::move(events));
  const support::TemporaryFolder folder;
  auto recorder = Recorder::create(folder.path() / "live.mcap", rig_, {0, 1}, {false, true});
  ASSERT_TRUE(recorder.ok());
  ASSERT_TRUE(live->wait_for_first_frame().ok());
  live->record_to(recorder->get());
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{3'000, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &small);
  live->begin();
  script_->open_gate();
  EXPECT_GE(all(*live).size(), 189u);
  const Status written = (*recorder)->finish();
  ::setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message().find("expected room for the recording"), std::string::npos);
}

}  // namespace
}  // namespace bslam::capture
