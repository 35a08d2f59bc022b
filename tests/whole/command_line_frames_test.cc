// The frames of poses: of the body or a camera, and of which submap.
#include "evaluation/trajectory_file.h"
#include "storage/map_file.h"
#include "storage/small_map.h"
#include "whole/command_line.h"

namespace bslam {
namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(CommandLine, AnEurocCsvKeepsTheFrameOfItsPoses) {
  const std::string truth = data() + "/groundtruth_cam0.tum", rig = " --rig " + data() + " --out ";
  ASSERT_EQ(run("export " + truth + " --format euroc --frame body" + rig + out("b.csv")).status, 0);
  ASSERT_EQ(run("export " + truth + " --format euroc --out " + out("c.csv")).status, 0);
  EXPECT_EQ(evaluation::read_comments(out("b.csv")).frame, "body");
  EXPECT_EQ(evaluation::read_comments(out("c.csv")).frame, "cam0");
  const std::string foreign = data() + "/mav0/state_groundtruth_estimate0/data.csv";
  for (const std::string& body : {out("b.csv"), foreign}) {
    expect_rejected("export " + body + " --out " + out("never.tum"));
    EXPECT_TRUE(has(read_text(out("stderr")), "frame: found body, expected a trajectory of a camera"));
    ASSERT_EQ(run("export " + body + " --overwrite" + rig + out("same.tum")).status, 0);
    EXPECT_EQ(evaluation::read_comments(out("same.tum")).frame, "body");
    ASSERT_EQ(run("export " + body + " --overwrite --frame cam0" + rig + out("camera.tum")).status, 0);
    EXPECT_EQ(evaluation::read_comments(out("camera.tum")).frame, "cam0");
    const std::string second = " --overwrite --frame cam1" + rig;
    ASSERT_EQ(run("export " + body + second + out("of_body.tum")).status, 0);
    ASSERT_EQ(run("export " + truth + second + out("of_camera.tum")).status, 0);
    for (const std::string& files : {out("same.tum") + " " + body, out("camera.tum") + " " + truth,
                                     out("of_body.tum") + " " + out("of_camera.tum")}) {
      const Ran ran = run("eval " + files + " --align none --json");
      EXPECT_LT(nlohmann::json::parse(ran.out)["ate"]["max"], 1e-6) << files << ran.err;
    }
  }
  ASSERT_EQ(run("export " + foreign + " --camera 1 --frame cam1" + rig + out("stated.tum")).status, 0);
  EXPECT_EQ(evaluation::read_comments(out("stated.tum")).frame, "cam1");
}

TEST_F(CommandLine, EvalSaysThatAnEurocCsvIsOfTheBody) {
  const std::string truth = data() + "/groundtruth_cam0.tum", rig = " --rig " + data();
  const std::string body = data() + "/mav0/state_groundtruth_estimate0/data.csv";
  const std::string taken = "which is an EuRoC csv, are taken to be those of the body";
  const Ran with = run("eval " + body + " " + truth + rig + " --align none --json");
  EXPECT_TRUE(has(with.err, taken)) << with.err;
  EXPECT_LT(nlohmann::json::parse(with.out)["ate"]["max"], 1e-6);
  const Ran without = run("eval " + body + " " + truth + " --align none --json");
  EXPECT_TRUE(has(without.err, "contains poses of body; the ground truth is taken to be of the same frame"));
  EXPECT_GT(nlohmann::json::parse(without.out)["ate"]["max"], 1e-3);
  ASSERT_EQ(run("export " + truth + " --format euroc --frame body" + rig + " --out " + out("mine.csv")).status, 0);
  EXPECT_EQ(run("eval " + out("mine.csv") + " " + body).err, "");
  EXPECT_TRUE(has(run("eval " + truth + " " + body).err, "EuRoC ground truth contains poses of the body"));
}

TEST_F(CommandLine, ASubmapHasOneNumber) {
  const std::string map = out("two.bmap");
  ASSERT_TRUE(storage::write_map(storage::small_map(synthetic::ring_rig(2)), {}, map));
  EXPECT_TRUE(has(run("map info " + map).out, "\nsubmap 1: 2 keyframes"));
  ASSERT_EQ(run("map export " + map + " --submap 1 --out " + out("two")).status, 0);
  EXPECT_EQ(evaluation::read_comments(out("two/keyframes_1.tum")).parent, "world_of_submap_1");
  const Ran moved = run("map transfer " + out("two/keyframes_1.tum") + " --from " + map + " --to " + map + " --out " +
                        out("second.tum"));
  EXPECT_TRUE(has(moved.out, "are in the frame world_of_submap_1\n")) << moved.out << moved.err;
  EXPECT_EQ(read_text(out("second.tum")), read_text(out("two/keyframes_1.tum")));
  expect_rejected("map export " + map + " --submap -1 --out " + out("never"));
  EXPECT_FALSE(has(read_text(out("stderr")), "18446744073709551615")) << read_text(out("stderr"));
}

}  // namespace
}  // namespace bslam
