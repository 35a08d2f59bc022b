// The runner of the ROS nodes, with images of a wall instead of topics.
#include "core/slam_runner.h"

#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "api/textured_wall.h"
#include "support/data_on_disk.h"

namespace bslam_ros {
namespace {

using bslam::support::TemporaryFolder;
using bslam::testing::TexturedWall;

// Collects what a node would publish.
struct Published {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<PoseOutput> poses;
  std::vector<PointCloud> clouds;
  std::vector<PathOutput> paths;
  std::vector<std::string> lines;

  template <class Value>
  void add(std::vector<Value>& to, const Value& value) {
    const std::lock_guard<std::mutex> lock(mutex);
    to.push_back(value);
    changed.notify_all();
  }
  bool wait_for_poses(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(300), [&] { return poses.size() >= count; });
  }
  Outputs outputs() {
    Outputs out;
    out.pose = [this](const PoseOutput& p) { add(poses, p); };
    out.cloud = [this](const PointCloud& c) { add(clouds, c); };
    out.path = [this](const PathOutput& p) { add(paths, p); };
    out.log = [this](bslam::LogLevel, const std::string& line) { add(lines, line); };
    return out;
  }
};

class RosRunner : public ::testing::Test {
 protected:
  RosRunner() {
    parameters_.image_topics = {"left/image", "right/image"};
    parameters_.settings = {"mode=sequential", "features.per_image=400"};
    parameters_.max_bundles = 1000;
    parameters_.cloud_period = parameters_.path_period = 0.5;
    // Axes of ROS: the wall's cameras move to the right, which is -y of base_link.
    Pose T_base_cam0;
    T_base_cam0.rotation = {-0.5, 0.5, -0.5, 0.5};
    rig_ = with_base_as_body(TexturedWall::rig(), T_base_cam0).value();
  }

  std::unique_ptr<SlamRunner> make_runner() {
    auto runner = SlamRunner::create(*rig_, parameters_, published_.outputs());
    EXPECT_TRUE(runner) << runner.error().message();
    return *std::move(runner);
  }

  void push(SlamRunner& runner, int k, std::size_t camera) {
    const auto image = wall_.image(k, static_cast<int>(camera));
    RawImage raw;
    raw.encoding = "mono8";
    raw.width = TexturedWall::kWidth;
    raw.height = TexturedWall::kHeight;
    raw.step = static_cast<std::size_t>(image.stride);
    raw.data = image.data;
    raw.size = raw.step * (raw.height - 1) + raw.width;
    const auto status = runner.push(camera, raw, image.time_ns);
    EXPECT_TRUE(status) << status.error().message();
  }
  void push(SlamRunner& runner, int from, int to, int) {
    for (int k = from; k < to; ++k) push(runner, k, std::size_t{1}), push(runner, k, std::size_t{0});
  }

  static std::string value(const std::vector<DiagnosticStatus>& statuses, std::size_t status, const std::string& key) {
    for (const auto& [name, value] : statuses[status].values) {
      if (name == key) return value;
    }
    return "no " + key;
  }

  TexturedWall wall_;
  Parameters parameters_;
  std::optional<bslam::Rig> rig_;
  Published published_;
  TemporaryFolder folder_;
};

constexpr int kFrames = 30;

TEST_F(RosRunner, PublishesPosesPointsPathAndTrajectory) {
  parameters_.trajectory_file = (folder_.path() / "end.tum").string();
  const auto runner = make_runner();
  push(*runner, 0, kFrames, 0);
  const auto stopped = runner->stop();
  ASSERT_TRUE(stopped) << stopped.error().message();
  ASSERT_EQ(published_.poses.size(), std::size_t{kFrames});
  const PoseOutput& last = published_.poses.back();
  EXPECT_EQ(last.time_ns, TexturedWall::kStart_ns + (kFrames - 1) * TexturedWall::kInterval_ns);
  const double travelled = TexturedWall::kSpeed * 0.05 * (kFrames - 1);
  EXPECT_NEAR(last.T_map_base.translation[1], -travelled, 0.05);
  EXPECT_NEAR(last.velocity.linear[1], -TexturedWall::kSpeed, 0.1);
  EXPECT_LT(last.covariance_map[0], 0.01);
  ASSERT_FALSE(published_.clouds.empty());
  ASSERT_GT(published_.clouds.back().points.size(), 50u);
  for (const auto& point : published_.clouds.back().points) EXPECT_NEAR(point.x, TexturedWall::kDepth, 0.6);  // ahead
  ASSERT_FALSE(published_.paths.empty());
  EXPECT_GT(published_.paths.back().poses.size(), 10u);
  EXPECT_NEAR(
      published_.paths.back().poses.back().second.translation[1],
      -TexturedWall::kSpeed * 1e-9 * static_cast<double>(published_.paths.back().time_ns - TexturedWall::kStart_ns),
      0.05);
  const auto statuses = runner->diagnostics();
  EXPECT_EQ(value(statuses, 0, "frames"), std::to_string(kFrames));
  EXPECT_EQ(value(statuses, 1, "images"), std::to_string(kFrames));
  const std::string written = bslam::support::read_text((folder_.path() / "end.tum").string());
  EXPECT_EQ(written.rfind("# bslam trajectory frame=body parent=map final=true\n", 0), 0u) << written.substr(0, 100);
  EXPECT_FALSE(std::filesystem::exists((folder_.path() / "end_1.tum").string()));
}

// The names of files that appear in a folder under their final name, by inotify. Two events with the same name are one
// unless there is another one between them, such as that of the unfinished file.
class Appearing {
 public:
  explicit Appearing(const std::filesystem::path& folder) : events_(inotify_init1(IN_NONBLOCK)) {
    inotify_add_watch(events_, folder.c_str(), IN_CREATE | IN_MOVED_TO);
  }
  ~Appearing() { close(events_); }
  Appearing(const Appearing&) = delete;
  Appearing& operator=(const Appearing&) = delete;
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    alignas(inotify_event) std::array<char, 4096> buffer;
    for (ssize_t size; (size = read(events_, buffer.data(), buffer.size())) > 0;) {
      for (const char* at = buffer.data(); at < buffer.data() + size;) {
        const auto* event = reinterpret_cast<const inotify_event*>(at);
        if (event->mask & IN_MOVED_TO) out.emplace_back(event->name);
        at += sizeof(inotify_event) + event->len;
      }
    }
    return out;
  }

 private:
  const int events_;
};

TEST_F(RosRunner, TheTrajectoryIsWrittenBeforeTheLastAdjustmentAndAfterIt) {
  parameters_.trajectory_file = (folder_.path() / "end.tum").string();
  const auto runner = make_runner();
  push(*runner, 0, kFrames, 0);
  ASSERT_TRUE(published_.wait_for_poses(kFrames));
  const Appearing appearing(folder_.path());
  ASSERT_TRUE(runner->stop());
  EXPECT_EQ(appearing.names(), (std::vector<std::string>{"end.tum", "end.tum"}));
}

TEST_F(RosRunner, OutputsMayThrow) {
  Outputs outputs = published_.outputs();
  outputs.pose = [this](const PoseOutput& p) {
    published_.add(published_.poses, p);
    throw std::runtime_error("nobody publishes");
  };
  outputs.log = [this](bslam::LogLevel, const std::string& line) {
    published_.add(published_.lines, line);
    if (line.rfind("a frame was not", 0) == 0) throw std::runtime_error("nobody logs");
  };
  const auto runner = SlamRunner::create(*rig_, parameters_, outputs);
  ASSERT_TRUE(runner) << runner.error().message();
  push(**runner, 0, 4, 0);
  EXPECT_TRUE((*runner)->stop());
  EXPECT_EQ(published_.poses.size(), 4u);
  EXPECT_EQ(std::count(published_.lines.begin(), published_.lines.end(),
                       "a frame was not processed or not published: nobody publishes"),
            1);  // not for each of the frames
  EXPECT_NE((*runner)->diagnostics()[0].message.find("nobody publishes"), std::string::npos);
}

TEST_F(RosRunner, ContinuesInALoadedMapWithTheSameOdometry) {
  parameters_.trajectory_file = (folder_.path() / "walk.tum").string();
  const auto runner = make_runner();
  const std::string map = (folder_.path() / "wall.bmap").string();
  EXPECT_FALSE(runner->set_localize_only(true));  // no map yet
  EXPECT_FALSE(runner->save_map(""));
  push(*runner, 0, kFrames, 0);
  ASSERT_TRUE(published_.wait_for_poses(kFrames));
  ASSERT_TRUE(runner->save_map(map));
  const auto loaded = runner->load_map(map, true);
  ASSERT_TRUE(loaded) << loaded.error().message();
  EXPECT_FALSE(runner->load_map((folder_.path() / "none.bmap").string(), true));
  push(*runner, kFrames, kFrames + 20, 0);
  ASSERT_TRUE(runner->stop());
  EXPECT_EQ(runner->diagnostics()[0].message, "localising");
  ASSERT_GT(published_.poses.size(), kFrames + 10u);
  for (std::size_t i = 1; i < published_.poses.size(); ++i) {
    const PoseOutput& pose = published_.poses[i];
    const double y = -TexturedWall::kSpeed * 1e-9 * static_cast<double>(pose.time_ns - TexturedWall::kStart_ns);
    EXPECT_NEAR(pose.T_map_base.translation[1], y, 0.06) << i;  // the same map frame
    const double step = pose.T_odom_base.translation[1] - published_.poses[i - 1].T_odom_base.translation[1];
    EXPECT_LT(std::abs(step), 0.1) << i;
    const Pose through_odom = pose.T_map_odom * pose.T_odom_base;
    EXPECT_NEAR(through_odom.translation[1], pose.T_map_base.translation[1], 1e-9);
  }
  // The poses before the change of the map are not lost.
  const std::string before = bslam::support::read_text((folder_.path() / "walk_1.tum").string());
  const std::string after = bslam::support::read_text((folder_.path() / "walk.tum").string());
  EXPECT_EQ(std::count(before.begin(), before.end(), '\n'), 1 + kFrames);
  EXPECT_GT(std::count(after.begin(), after.end(), '\n'), 1 + 10);
  EXPECT_FALSE(std::filesystem::exists((folder_.path() / "walk_2.tum").string()));
}

TEST_F(RosRunner, EverySubscriberGetsThePointsOfAMapThatDoesNotChange) {
  parameters_.map_file = (folder_.path() / "wall.bmap").string();
  {
    Parameters first = parameters_;
    first.map_file.clear();
    const auto runner = SlamRunner::create(*rig_, first, published_.outputs());
    ASSERT_TRUE(runner) << runner.error().message();
    push(**runner, 0, kFrames, 0);
    ASSERT_TRUE(published_.wait_for_poses(kFrames));
    ASSERT_TRUE((*runner)->save_map(parameters_.map_file));
  }
  published_.clouds.clear();
  published_.poses.clear();
  parameters_.settings.push_back("localize_only=true");
  parameters_.cloud_period = 0;
  Outputs outputs = published_.outputs();
  std::size_t calls = 0;
  outputs.cloud_subscribers = [&calls] { return ++calls < 5 ? std::size_t{1} : std::size_t{2}; };
  const auto runner = SlamRunner::create(*rig_, parameters_, outputs);
  ASSERT_TRUE(runner) << runner.error().message();
  push(**runner, kFrames, kFrames + 20, 0);
  ASSERT_TRUE((*runner)->stop());
  ASSERT_GT(calls, 5u);
  ASSERT_EQ(published_.clouds.size(), 2u);
  EXPECT_GT(published_.clouds.front().points.size(), 50u);
}

TEST_F(RosRunner, RejectedImagesAreCountedAndSaidOnce) {
  const auto runner = make_runner();
  const std::vector<std::uint8_t> bytes(100);
  RawImage image;
  image.encoding = "mono8";
  image.width = image.height = image.step = 10;
  image.data = bytes.data();
  image.size = bytes.size();
  EXPECT_FALSE(runner->push(1, image, 5));  // not the size of the calibration
  EXPECT_FALSE(runner->push(1, image, 6));
  EXPECT_EQ(value(runner->diagnostics(), 2, "rejected"), "2");
  EXPECT_EQ(published_.lines.size(), 1u);
  EXPECT_EQ(runner->diagnostics()[2].level, Level::kError);
}

TEST_F(RosRunner, DroppedImagesAreCountedAndSaidSeldom) {
  const auto runner = make_runner();
  push(*runner, 0, 1, 0);
  for (int k = 0; k < 1500; ++k) push(*runner, 0, std::size_t{1});  // duplicates
  const auto said = std::ranges::count_if(
      published_.lines, [](const std::string& line) { return line.find("dropped: duplicate") != std::string::npos; });
  EXPECT_EQ(said, 2);
  EXPECT_EQ(value(runner->diagnostics(), 2, "dropped (duplicate)"), "1500");
}

TEST_F(RosRunner, WrongStartsAreErrors) {
  parameters_.map_file = (folder_.path() / "none.bmap").string();
  EXPECT_FALSE(SlamRunner::create(*rig_, parameters_, {}));
  parameters_.map_file.clear();
  parameters_.settings.push_back("features.per_imag=3");
  const auto runner = SlamRunner::create(*rig_, parameters_, {});
  ASSERT_FALSE(runner);
  EXPECT_NE(runner.error().message().find("features.per_image"), std::string::npos);
}

}  // namespace
}  // namespace bslam_ros
