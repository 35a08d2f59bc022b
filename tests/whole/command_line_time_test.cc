// bslam bench --time, and the memory report of a run.
#include "whole/command_line.h"

namespace bslam {
namespace {

using nlohmann::ordered_json;

TEST_F(CommandLine, TimesOfARecordingCountTheSameWorkInEveryRun) {
  const std::string bench = "bench " + data() + " --time --set features.per_image=500 --out ";
  const Ran first = run(bench + out("times") + " --runs 2");
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_NE(first.out.find("counted work"), std::string::npos) << first.out;
  const auto times = ordered_json::parse(read_text(out("times/time.json")));
  EXPECT_EQ(times["runs"], 2);
  EXPECT_EQ(times["mode"], "sequential");
  EXPECT_TRUE(times["varying"].empty()) << times["varying"];
  EXPECT_EQ(times["work"]["frames"], 15);
  for (const char* count :
       {"keyframes", "landmarks", "observations", "images_extracted", "features_extracted", "solver_steps"}) {
    EXPECT_GT(times["work"][count], 0) << count;
  }
  for (const char* stage : {"read", "extract", "map"}) EXPECT_GT(times["stages"][stage]["calls"], 0) << stage;
  EXPECT_GT(times["process"]["frame_cpu_mean_ms"]["median"], 0.0);
  for (const char* file : {"report.md", "report.html", "run2/summary.json"})
    EXPECT_TRUE(fs::exists(folder_ / "times" / file)) << file;

  const std::string against = " --runs 1 --against ";
  const Ran again = run(bench + out("times2") + against + out("times/time.json"));
  EXPECT_EQ(again.status, again.out.find("MORE\n") == std::string::npos ? 0 : 1)
      << again.out;  // the machine may be busy
  EXPECT_EQ(again.out.find("DIFFERS\n"), std::string::npos) << again.out;
  EXPECT_NE(again.out.find("comparison"), std::string::npos) << again.out;
  EXPECT_EQ(ordered_json::parse(read_text(out("times2/time.json")))["work"], times["work"]);

  ordered_json changed = times;
  changed["work"]["solver_steps"] = 1;
  support::write_text(out("changed.json"), changed.dump());
  support::write_text(out("times2/run1/notes.txt"), "of the user");
  const Ran differs = run(bench + out("times2") + " --overwrite" + against + out("changed.json"));
  EXPECT_EQ(differs.status, 1) << differs.err;
  EXPECT_NE(differs.out.find("DIFFERS\n"), std::string::npos) << differs.out;
  EXPECT_TRUE(fs::exists(out("times2/run1/notes.txt")));

  changed.erase("stages");
  support::write_text(out("changed.json"), changed.dump());
  expect_rejected(bench + out("rejected") + against + out("changed.json"));
  changed = times;
  changed["data"] = "another";
  support::write_text(out("changed.json"), changed.dump());
  expect_rejected(bench + out("rejected") + against + out("changed.json"));
  expect_rejected(bench + out("rejected") + against + out("missing.json"));
  expect_rejected("bench " + data() + " --out " + out("rejected") + against + out("times/time.json"));  // no --time
}

TEST_F(CommandLine, MemoryReportNamesThePartsOfTheProcess) {
  const auto summary = summary_of("memory", "--mode sequential --memory-report");
  const nlohmann::json& memory = summary["memory"];
  double sum_mb = 0.0;
  std::map<std::string, double> mb;
  for (const auto& part : memory["report"]) {
    mb[part["part"]] = part["mb"];
    sum_mb += part["mb"].get<double>();
  }
  EXPECT_GT(sum_mb, 5.0);
  EXPECT_LT(sum_mb, memory["resident_mb"].get<double>());
  EXPECT_LE(memory["resident_mb"].get<double>(), memory["peak_mb"].get<double>() + 0.1);
  for (const char* part : {"map: keyframes", "map: features", "map: descriptors", "map: patches", "map: landmarks",
                           "map: observations", "place index", "vocabulary", "pyramids", "run record"}) {
    EXPECT_GT(mb[part], 0.0) << part;
  }
  EXPECT_NE(read_text(out("stdout")).find("memory at the end of the run"), std::string::npos);
  EXPECT_TRUE(summary["work"]["allocations"].is_null());
  const auto plain = summary_of("plain", "--mode sequential --end 0.3");
  EXPECT_FALSE(plain["memory"].contains("report"));
}

}  // namespace
}  // namespace bslam
