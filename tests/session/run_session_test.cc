#include "session/run_session.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "evaluation/trajectory_file.h"
#include "place/shipped_vocabulary.h"
#include "session/frame_source.h"
#include "session/report_data.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

namespace fs = std::filesystem;

// Eight frames of two cameras on disk, written once per process.
class Session : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("bslam_session_test_" + std::to_string(::getpid()));
    ThreadPool pool(2);
    const simulator::SimulationRequest request{.folder = folder() / "data",
                                               .rig = synthetic::ring_rig(2, 240),
                                               .recording = {.duration_s = 0.8, .rate_hz = 10},
                                               .tour = {.duration_s = 0.8},
                                               .imaging = {},
                                               .world = {.texel = 0.03, .light_texel = 0.8, .ambient_rays = 2}};
    const auto outcome = simulator::write_simulation(request, pool);
    ASSERT_TRUE(outcome.ok()) << outcome.error().message();
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }
  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  static dataset::Dataset dataset() {
    auto opened = dataset::open_dataset({.path = folder() / "data"});
    EXPECT_TRUE(opened.ok());
    return std::move(*opened);
  }
  static SessionOptions options() {
    SessionOptions o;
    o.config.mode = execution::Mode::kSequential;
    o.config.features.per_image = 400;
    return o;
  }
};

TEST_F(Session, ReadsFramesInOrder) {
  const dataset::Dataset data = dataset();
  DatasetFrames source(data, 2);
  for (std::size_t i = 0; i < data.frames.size(); ++i) {
    const auto item = source.next();
    ASSERT_TRUE(item.has_value());
    EXPECT_EQ(item->images.id, FrameId(i));
    EXPECT_EQ(item->images.time_ns, data.frames[i].time_ns);
    ASSERT_EQ(item->images.images.size(), 2u);
    for (const image::CameraImage& image : item->images.images) EXPECT_EQ(image.state, image::ImageState::kPresent);
  }
  EXPECT_FALSE(source.next().has_value());
  EXPECT_FALSE(source.next().has_value());
}

TEST_F(Session, ReaderStopsBeforeTheLastFrameParallel) {
  const dataset::Dataset data = dataset();
  for (std::size_t taken = 0; taken <= data.frames.size(); ++taken) {
    DatasetFrames source(data, 1 + taken % 3, taken % 2 == 0 ? ReaderPriority::kLow : ReaderPriority::kNormal);
    for (std::size_t i = 0; i < taken; ++i) EXPECT_TRUE(source.next().has_value());
  }
}

// Passes on the frames of a data set, as live cameras do, with every third one dropped.
class SomeFrames : public FrameSource {
 public:
  explicit SomeFrames(const dataset::Dataset& data) : frames_(data, 2) {}
  std::optional<Item> next() override {
    auto item = frames_.next();
    if (!item) return item;
    item->next_ns.reset();
    item->dropped = item->images.id.index() % 3 == 2;
    if (item->dropped)
      item->images.images.clear();
    else
      item->images.id = FrameId(fed_++);
    return item;
  }

 private:
  DatasetFrames frames_;
  std::size_t fed_ = 0;
};

TEST_F(Session, TakesTheFramesOfAnotherSource) {
  dataset::Dataset data = dataset();
  SomeFrames source(data);
  dataset::Dataset rig_only = data;
  rig_only.frames.clear();
  SessionOptions o = options();
  o.source = &source;
  const auto result = run_session(rig_only, o);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_TRUE(result->record.complete);
  ASSERT_EQ(result->record.frames.size(), data.frames.size());
  for (std::size_t i = 0; i < data.frames.size(); ++i) {
    EXPECT_EQ(result->record.frames[i].outcome() == FrameOutcome::kDropped, i % 3 == 2);
    EXPECT_DOUBLE_EQ(result->record.frames[i].time_s, to_seconds(data.frames[i].time_ns - data.first_time_ns));
  }
}

TEST_F(Session, ReaderSkipsFramesThatAreNotWanted) {
  const dataset::Dataset data = dataset();
  const TimeNs from = data.frames[2].time_ns, to = data.frames[5].time_ns;
  DatasetFrames source(data, 4, ReaderPriority::kNormal, [&](TimeNs t, TimeNs) { return from <= t && t < to; });
  for (std::size_t i = 0; i < data.frames.size(); ++i) {
    const auto item = source.next();
    ASSERT_TRUE(item.has_value());
    EXPECT_EQ(item->dropped, 2 <= i && i < 5);
    EXPECT_EQ(item->images.images.empty(), item->dropped);
    EXPECT_EQ(item->images.time_ns, data.frames[i].time_ns);
  }
}

// Passes on the frames of a data set, as live cameras do for which processing is too slow.
class Backlog : public FrameSource {
 public:
  explicit Backlog(const dataset::Dataset& data) : frames_(data, 2) {}
  std::optional<Item> next() override {
    auto item = frames_.next();
    if (!item) return item;
    item->next_ns.reset();
    item->waiting = 2;
    item->waiting_s = 0.1;
    return item;
  }

 private:
  DatasetFrames frames_;
};

TEST_F(Session, ReducesTheWorkIfFramesWait) {
  dataset::Dataset data = dataset();
  Backlog source(data);
  SessionOptions o = options();
  o.config.mode = execution::Mode::kParallel;
  o.config.features.per_image = 1200;  // so that a third of them suffices
  o.source = &source;
  const auto result = run_session(data, o);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(count(result->record, FrameOutcome::kTracked), 8);
  EXPECT_EQ(result->record.frames[0].record->reduction, 0);
  EXPECT_EQ(result->record.frames[1].record->reduction, 1);
  EXPECT_EQ(result->record.frames[7].record->reduction, kMaxReduction);
  EXPECT_EQ(reduced_intervals(result->record).size(), 3u);
  SessionOptions again = options();
  again.config.features.per_image = 1200;
  again.replay = result->journal;
  const auto replayed = run_session(data, again);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(replayed->journal.entries, result->journal.entries);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_EQ(replayed->record.frames[i].record->reduction, result->record.frames[i].record->reduction);
  EXPECT_EQ(evaluation::tum_text(replayed->trajectories.front().poses, ""),
            evaluation::tum_text(result->trajectories.front().poses, ""));

  o.config.mode = execution::Mode::kSequential;  // repeatable runs do the same whatever the load
  Backlog once_more(data);
  o.source = &once_more;
  const auto repeatable = run_session(data, o);
  ASSERT_TRUE(repeatable.ok());
  EXPECT_TRUE(reduced_intervals(repeatable->record).empty());
}

TEST_F(Session, WritesAllItsFiles) {
  const dataset::Dataset data = dataset();
  SessionOptions o = options();
  std::vector<std::size_t> progress;
  o.progress = [&](std::size_t done, std::size_t all) {
    EXPECT_EQ(all, 8u);
    progress.push_back(done);
  };
  const auto result = run_session(data, o);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(progress, (std::vector<std::size_t>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_TRUE(result->record.complete);
  EXPECT_EQ(result->record.frames.size(), 8u);
  EXPECT_EQ(result->trajectories.front().poses.size(), 8u);
  EXPECT_EQ(result->live.front().poses.size(), 8u);
  EXPECT_EQ(result->record.mode, "sequential");
  EXPECT_EQ(result->record.map.scale, "metric");
  EXPECT_EQ(result->record.maps_started, 1);
  for (const CameraRecord& c : result->record.cameras) EXPECT_EQ(c.images, 8);

  const fs::path out = folder() / "out";
  EXPECT_GT(write_outputs(*result, o.config, out).size(), 5u);  // the caller must create the folder
  fs::create_directory(out);
  ASSERT_TRUE(write_outputs(*result, o.config, out).empty());
  for (const char* name : {"trajectory.tum", "trajectory_live.tum", "covariance_live.csv", "summary.json",
                           "config.yaml", "trajectory.svg", "run.svg"}) {
    EXPECT_GT(fs::file_size(out / name), 50u) << name;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 7);  // and no partially written file
}

// The text of the element of the page with the data.
std::string data_of_page(const std::string& page) {
  const std::string begin = R"(id="bslam-data">)";
  const std::size_t from = page.find(begin) + begin.size();
  return page.substr(from, page.find("</script>", from) - from);
}

TEST_F(Session, WritesTheReportIfItIsAskedFor) {
  const dataset::Dataset data = dataset();
  const SessionOptions o = options();
  auto result = run_session(data, o);
  ASSERT_TRUE(result.ok());
  const std::string hostile = "a</script><script>alert('x')</script>&\xff";
  result->record.data = hostile;
  const fs::path out = folder() / "report";
  fs::create_directory(out);
  ASSERT_TRUE(write_outputs(*result, o.config, out, ReportSource{data, "bslam run '" + hostile + "'"}).empty());
  EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 8);
  std::ostringstream text;
  text << std::ifstream(out / "report.html").rdbuf();
  EXPECT_EQ(text.str().find("<script>alert"), std::string::npos);
  const auto json = nlohmann::json::parse(data_of_page(text.str()));
  EXPECT_EQ(json["summary"]["data"], "a</script><script>alert('x')</script>&\ufffd");
  EXPECT_EQ(json["rig"].size(), 2u);
  EXPECT_EQ(json["frames"]["cameras"].size(), 2u);
  EXPECT_EQ(json["residuals"].size(), 2u);
  EXPECT_EQ(json["submaps"].size(), 1u);
  EXPECT_EQ(json["submaps"][0]["frames"], 8);
  EXPECT_EQ(json["truth"]["ate_m"]["count"], 8);
  EXPECT_LT(json["truth"]["ate_m"]["rmse"], 0.05);
}

TEST_F(Session, ViewsOfTheReportHaveTheUpwardDirectionThatIsGiven) {
  const dataset::Dataset data = dataset();
  const SessionOptions o = options();
  const auto result = run_session(data, o);
  ASSERT_TRUE(result.ok());
  const auto up_of = [&](const std::optional<geometry::UpAxis>& up) {
    const auto json = report_json(*result, o.config, {data, "bslam run", up});
    return Eigen::Vector3d(json["submaps"][0]["up"].get<std::vector<double>>().data());
  };
  const Eigen::Vector3d given(0.6, 0, -0.8);
  EXPECT_LT((up_of(geometry::UpAxis{geometry::UpAxis::Frame::kWorld, given}) - given).norm(), 1e-6);
  const auto body = up_of(geometry::UpAxis{geometry::UpAxis::Frame::kBody, Eigen::Vector3d::UnitZ()});
  const auto camera = up_of({});
  EXPECT_GT(body.dot(camera), 0.95);  // the body is level
  EXPECT_GT((body - camera).norm(), 1e-6);
}

// Poses of camera 0 beside mav0 are ground truth as well.
TEST_F(Session, ReportComparesWithTheTruthOfCamera0) {
  const fs::path linked = folder() / "linked";
  fs::create_directories(linked / "mav0");
  for (const char* camera : {"mav0/cam0", "mav0/cam1"})
    fs::create_directory_symlink(folder() / "data" / camera, linked / camera);
  fs::copy_file(folder() / "data/groundtruth_cam0.tum", linked / "groundtruth_cam0.tum");
  for (const std::vector<int>& cameras : {std::vector{0, 1}, std::vector{1, 0}}) {
    const auto data = dataset::open_dataset({.path = linked, .cameras = cameras});
    ASSERT_TRUE(data);
    ASSERT_TRUE(data->ground_truth);
    const auto result = run_session(*data, options());
    ASSERT_TRUE(result.ok());
    const auto truth = report_json(*result, options().config, {*data, ""})["truth"];
    EXPECT_EQ(truth["file"], "groundtruth_cam0.tum");
    EXPECT_LT(truth["ate_m"]["rmse"], 0.01) << truth["ate_m"];
  }
}

TEST_F(Session, ReportsOfEqualRunsDifferInTimesOnly) {
  const dataset::Dataset data = dataset();
  const SessionOptions o = options();
  const auto without_times = [&] {
    const auto result = run_session(data, o);
    EXPECT_TRUE(result.ok());
    nlohmann::ordered_json json = report_json(*result, o.config, {data, "bslam run"});
    for (const char* key : {"time", "memory"}) json["summary"].erase(key);
    json["frames"].erase("ms");
    for (auto& stage : json["stages"]) {
      stage.erase("ms");
      stage.erase("total_ms");
    }
    return json.dump();
  };
  EXPECT_EQ(without_times(), without_times());
}

TEST_F(Session, ReportListsTheSettingsWithTheirDefaults) {
  const dataset::Dataset data = dataset();
  SessionResult result;
  result.map = std::make_shared<map::BundledMap>(std::make_shared<camera::Rig>(data.rig));
  const auto json = report_json(result, options().config, {data, ""});
  std::size_t changed = 0;
  for (const auto& setting : json["settings"]) changed += setting["value"] != setting["default"];
  EXPECT_EQ(changed, 2u);  // mode and features.per_image
  EXPECT_TRUE(json["submaps"].empty());
  EXPECT_TRUE(json["truth"].is_null());
}

TEST_F(Session, WritesFilesForEverySubmap) {
  SessionOptions o = options();
  auto result = run_session(dataset(), o);
  ASSERT_TRUE(result.ok());
  result->trajectories.push_back(
      {KeyframeId(7), {result->trajectories.front().poses.begin() + 5, result->trajectories.front().poses.end()}});
  const fs::path out = folder() / "parts";
  fs::create_directory(out);
  ASSERT_TRUE(write_outputs(*result, o.config, out).empty());
  const auto lines = [&](const char* name) {
    std::ifstream file(out / name);
    return std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  };
  EXPECT_EQ(lines("trajectory.tum"), 2 + 8);  // comments and poses
  EXPECT_EQ(lines("trajectory_part2.tum"), 2 + 3);
  EXPECT_EQ(lines("trajectory_live.tum"), 1 + 8);
  EXPECT_FALSE(fs::exists(out / "trajectory_live_part2.tum"));
}

// The same is subtracted from all times, also those of frames without camera 0, so that they stay in order.
TEST_F(Session, WritesTheStampsOfImagesIfRequested) {
  auto result = run_session(dataset(), options());
  ASSERT_TRUE(result.ok());
  result->subtracted_ns = 3'000'000;
  const fs::path out = folder() / "stamps";
  fs::create_directories(out);
  ASSERT_TRUE(write_outputs(*result, options().config, out).empty());
  std::ostringstream text;
  text << std::ifstream(out / "trajectory.tum").rdbuf();
  EXPECT_NE(text.str().find("\n# time stamps are those of the images"), std::string::npos);
  const auto written = evaluation::read_trajectory(out / "trajectory.tum");
  ASSERT_TRUE(written) << written.error().message();
  const evaluation::Trajectory& poses = result->trajectories.front().poses;
  ASSERT_EQ(written->size(), poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) EXPECT_EQ((*written)[k].time_ns, poses[k].time_ns - 3'000'000);
  std::ifstream covariances(out / "covariance_live.csv");
  std::string line;
  std::getline(covariances, line);
  ASSERT_TRUE(std::getline(covariances, line));
  const TimeNs first_ns = std::stoll(line) + 3'000'000;
  EXPECT_TRUE(std::ranges::any_of(poses, [&](const auto& pose) { return pose.time_ns == first_ns; })) << line;
}

TEST_F(Session, ContinuesTheMapOfAnEarlierRun) {
  SessionOptions o = options();
  o.vocabulary = place::shipped_vocabulary().value();
  const auto first = run_session(dataset(), o);
  ASSERT_TRUE(first.ok());
  EXPECT_FALSE(first->record.map.loaded);
  EXPECT_TRUE(first->record.relocalisations.empty());
  ASSERT_EQ(first->record.submaps.size(), 1u);
  EXPECT_EQ(first->record.submaps.front().frames, 8);
  EXPECT_EQ(first->record.submaps.front().trajectory, "trajectory.tum");
  o.map = *first->map;
  o.config.localize_only = true;
  const auto second = run_session(dataset(), o);
  ASSERT_TRUE(second.ok());
  EXPECT_TRUE(second->record.map.loaded);
  EXPECT_EQ(second->record.maps_started, 0);
  EXPECT_EQ(second->record.map.keyframes, first->record.map.keyframes);
  EXPECT_EQ(second->map->version(), first->map->version());
  ASSERT_EQ(second->trajectories.size(), 1u);
  EXPECT_EQ(second->trajectories.front().poses.size(), 8u);
  ASSERT_EQ(second->record.relocalisations.size(), 1u);
  EXPECT_EQ(second->record.relocalisations.front().at_s, 0.0);
  EXPECT_GE(second->record.relocalisations.front().inliers, 50);
  // The residuals are those of the run, not of the map.
  for (std::size_t c = 0; c < 2; ++c) {
    const calibration::ImageResiduals &of_run = second->record.cameras[c].residuals,
                                      &of_map = first->record.cameras[c].residuals;
    std::int64_t inliers = 0;
    for (const RunFrame& frame : second->record.frames) inliers += frame.record->final_result().cameras[c].inliers;
    EXPECT_EQ(of_run.observations, static_cast<std::size_t>(inliers));
    EXPECT_NE(of_run.observations, of_map.observations);
    EXPECT_GT(of_run.rms_px, 0.3 * of_map.rms_px);
    EXPECT_LT(of_run.rms_px, 3 * of_map.rms_px);
  }
}

TEST_F(Session, TracksAllFramesInParallelMode) {
  SessionOptions o = options();
  o.config.mode = execution::Mode::kParallel;
  const auto result = run_session(dataset(), o);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->trajectories.front().poses.size(), 8u);
  EXPECT_EQ(result->record.mode, "parallel");
}

TEST_F(Session, EndsWhenInterrupted) {
  std::stop_source interruption;
  SessionOptions o = options();
  o.interrupted = interruption.get_token();
  o.progress = [&](std::size_t done, std::size_t) {
    if (done == 3) interruption.request_stop();
  };
  const auto result = run_session(dataset(), o);
  ASSERT_TRUE(result.ok());
  EXPECT_FALSE(result->record.complete);
  EXPECT_EQ(result->record.frames.size(), 3u);
  EXPECT_EQ(result->trajectories.front().poses.size(), 3u);
  EXPECT_FALSE(ended_at_once(result->record));
  const auto nothing = run_session(dataset(), o);
  ASSERT_TRUE(nothing.ok());
  EXPECT_FALSE(nothing->record.complete);
  EXPECT_TRUE(nothing->record.frames.empty());
  EXPECT_TRUE(ended_at_once(nothing->record));
  fs::create_directory(folder() / "nothing");
  EXPECT_TRUE(write_outputs(*nothing, o.config, folder() / "nothing").empty());
}

TEST_F(Session, ReplaysCompleteAndInterruptedRuns) {
  for (const std::size_t end : {3u, 8u}) {
    std::stop_source interruption;
    SessionOptions o = options();
    o.config.mode = execution::Mode::kParallel;
    o.interrupted = interruption.get_token();
    o.progress = [&](std::size_t done, std::size_t all) {
      if (done == end && end < all) interruption.request_stop();
    };
    const auto recorded = run_session(dataset(), o);
    ASSERT_TRUE(recorded.ok());
    SessionOptions again = options();
    again.replay = recorded->journal;
    const auto replayed = run_session(dataset(), again);
    ASSERT_TRUE(replayed.ok()) << replayed.error().message();
    EXPECT_EQ(replayed->record.mode, "replay");
    EXPECT_EQ(replayed->record.complete, end == 8);
    EXPECT_EQ(replayed->journal.entries, recorded->journal.entries);
    ASSERT_EQ(replayed->trajectories.front().poses.size(), end);
    for (std::size_t i = 0; i < end; ++i) {
      EXPECT_EQ(replayed->trajectories.front().poses[i].T_world_frame.translation(),
                recorded->trajectories.front().poses[i].T_world_frame.translation());
      EXPECT_EQ(replayed->live.front().poses[i].T_world_frame.translation(),
                recorded->live.front().poses[i].T_world_frame.translation());
    }
  }
}

TEST_F(Session, RejectsAJournalOfAnotherRun) {
  SessionOptions o = options();
  const auto recorded = run_session(dataset(), o);
  ASSERT_TRUE(recorded.ok());
  o.replay = recorded->journal;
  o.replay->name = "other.journal";
  o.replay->entries[1].input = 5;
  const auto replayed = run_session(dataset(), o);
  ASSERT_FALSE(replayed.ok());
  EXPECT_EQ(replayed.error().file, "other.journal");
  EXPECT_EQ(replayed.error().key, "entry 1");
}

TEST_F(Session, CountsADamagedImageAsSkippedAndContinues) {
  const dataset::Dataset data = dataset();
  const fs::path victim = data.frames[4].images[1]->path, kept = folder() / "kept.png";
  fs::rename(victim, kept);
  std::ofstream(victim) << "not an image";
  const auto result = run_session(data, options());
  fs::rename(kept, victim);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->record.cameras[0].skipped, 0);
  EXPECT_EQ(result->record.cameras[1].skipped, 1);
  EXPECT_EQ(result->record.cameras[1].first_skipped.find(victim.string()), 0u)
      << result->record.cameras[1].first_skipped;
  EXPECT_EQ(result->record.cameras[1].images, 7);
  ASSERT_EQ(result->record.frames.size(), 8u);
  EXPECT_EQ(result->record.frames[4].record->images[1], image::ImageState::kDamaged);
  for (const RunFrame& f : result->record.frames) EXPECT_EQ(f.outcome(), FrameOutcome::kTracked);
}

TEST_F(Session, ReportsAnUnreadableMask) {
  dataset::Dataset data = dataset();
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < data.rig.size(); ++c) cameras.push_back({data.rig.camera(c), data.rig.body_from_cam(c)});
  cameras[1].camera.mask_file = (folder() / "no_such_mask.png").string();
  data.rig = camera::Rig(cameras);
  const auto result = run_session(data, options());
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message().find("no_such_mask.png"), std::string::npos);
}

}  // namespace
}  // namespace bslam::session
