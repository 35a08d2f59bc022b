#include "evaluation/trajectory_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/random.h"

namespace bslam::evaluation {
namespace {

using geometry::Quaterniond;
using geometry::SE3;
using geometry::Vector3d;

// Creates a separate folder for each test and removes it afterwards.
class TrajectoryFile : public testing::Test {
 protected:
  TrajectoryFile()
      : folder_(std::filesystem::temp_directory_path() /
                ("bslam_trajectory_" + std::to_string(getpid()) + "_" +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(folder_);
  }
  ~TrajectoryFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  // Returns the error message for a file with these bytes, without the folder; empty if it can be read.
  std::string error_of(const std::string& bytes) const {
    const auto result = read_trajectory(write("t.txt", bytes));
    if (result.ok()) return {};
    return result.error().message().substr(folder_.string().size() + 1);
  }

  std::filesystem::path folder_;
};

Trajectory random_trajectory() {
  Random random(5, "trajectory");
  Trajectory trajectory;
  TimeNs time = 1'403'636'579'763'555'584;
  for (int i = 0; i < 50; ++i) {
    time += 1 + random.below(100'000'000);
    const Vector3d omega(random.normal(), random.normal(), random.normal());
    trajectory.push_back(
        {time, SE3(geometry::so3_exp(omega), Vector3d(100 * random.normal(), random.normal(), random.normal()))});
  }
  return trajectory;
}

void expect_equal(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].time_ns, b[i].time_ns);
    EXPECT_LT((a[i].T_world_frame.translation() - b[i].T_world_frame.translation()).norm(), 1e-6);
    EXPECT_LT(a[i].T_world_frame.rotation().angularDistance(b[i].T_world_frame.rotation()), 1e-8);
  }
}

TEST(ParseSeconds, IsExactToTheNanosecond) {
  EXPECT_EQ(parse_seconds("1403636579.763555584"), 1'403'636'579'763'555'584);
  EXPECT_EQ(parse_seconds("1317045937"), 1'317'045'937'000'000'000);
  EXPECT_EQ(parse_seconds("0.000000001"), 1);
  EXPECT_EQ(parse_seconds(".5"), 500'000'000);
  EXPECT_EQ(parse_seconds("5."), 5'000'000'000);
  EXPECT_EQ(parse_seconds("-1.25"), -1'250'000'000);
  EXPECT_EQ(parse_seconds("+1.25"), 1'250'000'000);
}

TEST(ParseSeconds, ReadsExponents) {
  EXPECT_EQ(parse_seconds("1.044989e-01"), 104'498'900);
  EXPECT_EQ(parse_seconds("0.000000e+00"), 0);
  EXPECT_EQ(parse_seconds("1.403636579763555584e9"), 1'403'636'579'763'555'584);
  EXPECT_EQ(parse_seconds("14E2"), 1'400'000'000'000);
  EXPECT_EQ(parse_seconds("1e-99"), 0);
}

TEST(ParseSeconds, RoundsToNanoseconds) {
  EXPECT_EQ(parse_seconds("1.0000000004"), 1'000'000'000);
  EXPECT_EQ(parse_seconds("1.0000000005"), 1'000'000'001);
  EXPECT_EQ(parse_seconds("5e-10"), 1);
  EXPECT_EQ(parse_seconds("4.9e-10"), 0);
}

TEST(ParseSeconds, RejectsInvalidTimes) {
  for (const char* text : {"", "-", ".", "e5", "1.2.3", "1,5", "nan", "inf", "0x10", "1e", "1e1e1", "--1", "1 ",
                           "4000000001", "99999999999999999999999", "1e99", "1e999999999999"}) {
    EXPECT_EQ(parse_seconds(text), std::nullopt) << text;
  }
}

TEST_F(TrajectoryFile, RoundTrips) {
  const Trajectory trajectory = random_trajectory();
  for (const TrajectoryFormat format :
       {TrajectoryFormat::kTum, TrajectoryFormat::kEurocCsv, TrajectoryFormat::kKitti}) {
    ASSERT_TRUE(write_trajectory(folder_ / "out", trajectory, format, "any header").ok());
    const auto read = read_trajectory(folder_ / "out");
    ASSERT_TRUE(read.ok()) << read.error().message();
    expect_equal(*read, trajectory);
  }
}

TEST_F(TrajectoryFile, KittiKeepsTheTimesOfARecordingUnlessTheyAreToBeReplaced) {
  const auto times_in_folder = [&] {
    std::ifstream in(folder_ / "times.txt");
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const Trajectory trajectory = random_trajectory();
  EXPECT_FALSE(write_trajectory(folder_ / "times.txt", trajectory, TrajectoryFormat::kKitti, {}, true));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "times.txt"));
  write("times.txt", "those of the images");
  const Status refused = write_trajectory(folder_ / "poses.txt", trajectory, TrajectoryFormat::kKitti);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().file, (folder_ / "times.txt").string());
  EXPECT_EQ(times_in_folder(), "those of the images");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "poses.txt"));
  ASSERT_TRUE(write_trajectory(folder_ / "poses.txt", trajectory, TrajectoryFormat::kKitti, {}, true));
  EXPECT_EQ(times_in_folder(), times_text(trajectory));
}

TEST_F(TrajectoryFile, WritesTumWithHeaderAndNineDecimals) {
  const Trajectory trajectory = {{1'250'000'001, SE3(Quaterniond(1, 0, 0, 0), Vector3d(1, -2, 0.5))}};
  EXPECT_EQ(tum_text(trajectory, trajectory_header("cam0", PoseState::kFinal)),
            "# bslam trajectory frame=cam0 parent=world final=true\n"
            "1.250000001 1.000000000 -2.000000000 0.500000000 0.000000000 0.000000000 0.000000000 1.000000000\n");
  EXPECT_EQ(trajectory_header("body", PoseState::kLive), "bslam trajectory frame=body parent=world final=false");
}

// Programs for EuRoC files skip lines that begin with #, or just the first line.
TEST_F(TrajectoryFile, AnEurocCsvHasItsCommentsInTheTitle) {
  const std::string header = trajectory_header("body", PoseState::kLive, "map") + "\n# " +
                             scale_comment("up-to-scale") + "\n# " + image_stamp_comment();
  const Trajectory trajectory = random_trajectory();
  const std::string text = euroc_csv_text(trajectory, header), title = text.substr(0, text.find('\n'));
  EXPECT_EQ(std::ranges::count(text, '#'), 4);
  EXPECT_EQ(std::ranges::count(title, ','), 7);
  EXPECT_EQ(text.find("#timestamp [ns],p_x [m],"), 0u);
  const TrajectoryComments comments = read_comments(write("t.csv", text));
  EXPECT_EQ(comments.frame_of_poses(), "body");
  EXPECT_EQ(comments.parent, "map");
  EXPECT_EQ(comments.state, PoseState::kLive);
  EXPECT_EQ(comments.scale, "up-to-scale");
  EXPECT_TRUE(comments.image_stamps);
  const std::string camera = euroc_csv_text(trajectory, trajectory_header("cam0", PoseState::kFinal));
  EXPECT_EQ(read_comments(write("t.csv", camera)).frame_of_poses(), "cam0");
}

TEST_F(TrajectoryFile, ThePosesOfAnEurocCsvAreOfTheBodyUnlessItSaysOtherwise) {
  for (const std::string title : {"#timestamp, p_RS_R_x [m], p_RS_R_y [m]\r\n", "timestamp,p_x\n", ""}) {
    const TrajectoryComments comments = read_comments(write("t.csv", title + "1,1,2,3,1,0,0,0,0.1\n"));
    EXPECT_EQ(comments.frame, "") << title;
    EXPECT_EQ(comments.frame_of_poses(), "body") << title;
  }
  EXPECT_EQ(read_comments(write("t", "# a, b\n1.5 1 2 3 0 0 0 1\n")).frame_of_poses(), "");
}

TEST_F(TrajectoryFile, CommentsAreReadAsTheyAreWritten) {
  const std::string header = "# " + trajectory_header("left", PoseState::kLive, "world_of_submap_2") + "\n# " +
                             scale_comment("up-to-scale") + "\n# " + image_stamp_comment() + "\n";
  std::string foreign = "\xEF\xBB\xBF" + header;  // as an editor of another system saves it
  for (std::size_t at = 0; (at = foreign.find('\n', at)) != std::string::npos; at += 2) foreign.insert(at, 1, '\r');
  for (const std::string& text : {header, foreign}) {
    const TrajectoryComments comments = read_comments(write("t", text + "1.5 1 2 3 0 0 0 1\n# scale=other\n"));
    EXPECT_EQ(comments.frame, "left");
    EXPECT_EQ(comments.parent, "world_of_submap_2");
    EXPECT_EQ(comments.state, PoseState::kLive);
    EXPECT_EQ(comments.scale, "up-to-scale");
    EXPECT_TRUE(comments.image_stamps);
    EXPECT_EQ("# " + text_of(comments) + "\n", header);
  }
  for (const char* text : {"", "# frame=left", "# my notes: scale=3\n1.5 1 2 3 0 0 0 1\n"}) {
    const TrajectoryComments none = read_comments(write("t", text));
    EXPECT_EQ(none.frame, "") << text;
    EXPECT_EQ(none.parent, "world") << text;
    EXPECT_EQ(none.state, PoseState::kFinal) << text;
    EXPECT_EQ(none.scale, "metric") << text;
    EXPECT_FALSE(none.image_stamps) << text;
  }
}

TEST_F(TrajectoryFile, ReadsTumWithCommentsTabsAndForeignLineEnds) {
  const auto read =
      read_trajectory(write("t", "\xEF\xBB\xBF# comment\r\n\r\n 1.5\t1 2 3  0 0 0 1 \r\n# x\r\n2 1 2 3 0 0 0.6 0.8"));
  ASSERT_TRUE(read.ok()) << read.error().message();
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].time_ns, 1'500'000'000);
  EXPECT_EQ((*read)[1].T_world_frame.translation(), Vector3d(1, 2, 3));
  EXPECT_NEAR((*read)[1].T_world_frame.rotation().w(), 0.8, 1e-15);
}

TEST_F(TrajectoryFile, ReadsEurocCsvWithFurtherColumns) {
  const auto read =
      read_trajectory(write("t",
                            "#timestamp, p_RS_R_x [m], ...\n1403636580838555648,4.6,-1.7,0.8,0.8,0,-0.6,0,"
                            "-0.0,nan,x\n1403636580843555328,4.6,-1.7,0.8,1,0,0,0\n"));
  ASSERT_TRUE(read.ok()) << read.error().message();
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].time_ns, 1'403'636'580'838'555'648);
  EXPECT_NEAR((*read)[0].T_world_frame.rotation().w(), 0.8, 1e-15);
  EXPECT_NEAR((*read)[0].T_world_frame.rotation().y(), -0.6, 1e-15);
}

TEST_F(TrajectoryFile, ReadsKittiPosesWithTheirTimes) {
  const auto poses = write("06.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 5 1 0 0 6 0 0 1 7\n");
  EXPECT_EQ(
      read_trajectory(poses).error().message(),
      poses.string() + ": found KITTI poses without times, expected times.txt in the same folder, or --times FILE");
  const auto times = write("other.txt", "0.000000e+00\n1.044989e-01\n");
  const auto read = read_trajectory(poses, times);
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ((*read)[1].time_ns, 104'498'900);
  EXPECT_EQ((*read)[1].T_world_frame.translation(), Vector3d(5, 6, 7));
  EXPECT_LT(((*read)[1].T_world_frame.rotation() * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-12);
  write("times.txt", "0\n");
  EXPECT_EQ(read_trajectory(poses).error().found, "1 times");
  write("times.txt", "1\n1\n");
  EXPECT_FALSE(read_trajectory(poses).ok());
  write("times.txt", "1\nlater\n");
  EXPECT_EQ(read_trajectory(poses).error().key, "line 2");
}

TEST_F(TrajectoryFile, ErrorsNameTheLine) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0\n"),
            "t.txt: line 2: found 6 fields, expected 8 (t x y z qx qy qz qw), in TUM files");
  EXPECT_EQ(error_of(good + "# c\n2 0 nan 0 0 0 0 1\n"), "t.txt: line 3: found 'nan', expected a finite number");
  EXPECT_EQ(error_of(good + "2 0 inf 0 0 0 0 1\n"), "t.txt: line 2: found 'inf', expected a finite number");
  EXPECT_EQ(error_of(good + "2 0 1e999 0 0 0 0 1\n"), "t.txt: line 2: found '1e999', expected a finite number");
  EXPECT_EQ(error_of(good + "2 0 1.5x 0 0 0 0 1\n"), "t.txt: line 2: found '1.5x', expected a finite number");
  EXPECT_EQ(error_of(good + "nan 0 0 0 0 0 0 1\n"), "t.txt: line 2: found 'nan', expected a time in seconds");
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0 0 0\n"), "t.txt: line 2: found a quaternion of norm 0, expected norm 1");
  EXPECT_EQ(error_of(good + "2 0 0 0 1 1 0 1\n"), "t.txt: line 2: found a quaternion of norm 1.73205, expected norm 1");
  EXPECT_EQ(error_of("1 0 0 0 0 1 0 0 0 0 2 0\n"),
            "t.txt: found KITTI poses without times, expected times.txt in the same folder, or --times FILE");
  EXPECT_NE(error_of("1,2,3,4,1,0,0,0\n2.5,2,3,4,1,0,0,0\n")
                .find("line 2: found '2.5', expected a time in integer nanoseconds"),
            std::string::npos);
  for (const char* time : {"-9223372036854775808", "9223372036854775807", "-4000000000000000001"}) {
    EXPECT_NE(error_of(std::string(time) + ",2,3,4,1,0,0,0\n").find("expected a time in integer nanoseconds"),
              std::string::npos)
        << time;
  }
  EXPECT_NE(error_of("1,2,3,4,1,0,0,0\n2,2,,4,1,0,0,0\n").find("line 2: found '', expected a finite number"),
            std::string::npos);
}

TEST_F(TrajectoryFile, RejectsTimesThatDoNotIncrease) {
  EXPECT_EQ(error_of("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"),
            "t.txt: line 2: found 1.000000000 s after 2.000000000 s, expected increasing times");
  EXPECT_NE(error_of("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"), "");
}

TEST_F(TrajectoryFile, RejectsFilesOfOtherFormats) {
  EXPECT_EQ(error_of(""), "t.txt: found no poses, expected a TUM, EuRoC csv or KITTI trajectory");
  EXPECT_EQ(error_of("# only a comment\n"), "t.txt: found no poses, expected a TUM, EuRoC csv or KITTI trajectory");
  EXPECT_NE(error_of("1 2 3\n").find("line 1: found 3 fields"), std::string::npos);
  EXPECT_NE(error_of(std::string("\0\x01\xFF\n", 4)), "");
  EXPECT_FALSE(read_trajectory(folder_).ok());
  EXPECT_FALSE(read_trajectory(folder_ / "absent").ok());
}

TEST_F(TrajectoryFile, RejectsAMatrixThatIsNotARotation) {
  write("times.txt", "1\n2\n");
  EXPECT_NE(error_of("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 -1 0\n")
                .find("line 2: found a matrix that is not a rotation"),
            std::string::npos);
}

TEST_F(TrajectoryFile, HandlesEveryTruncation) {
  const std::string whole = tum_text(random_trajectory(), "header").substr(0, 250);
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    const auto result = read_trajectory(write("t.txt", whole.substr(0, length)));
    EXPECT_TRUE(result.ok() || !result.error().found.empty()) << length;
  }
}

}  // namespace
}  // namespace bslam::evaluation
