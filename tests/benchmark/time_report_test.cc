// Times of several runs, their file, and the comparison of two of them.
#include "benchmark/time_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "benchmark/time_comparison.h"

namespace bslam::benchmark {
namespace {

using nlohmann::ordered_json;

// The summary of a run of 10 frames whose extraction takes `ms` per frame.
ordered_json summary(double ms, std::int64_t steps = 700) {
  const ordered_json stage = {{"median", ms}, {"p95", 2 * ms}, {"max", 3 * ms}, {"count", 10}, {"total", 10 * ms}};
  return {{"time",
           {{"wall_s", 0.02 * ms},
            {"cpu_s", 0.03 * ms},
            {"frame_ms", {{"median", 2 * ms}, {"p95", 3 * ms}}},
            {"stages_ms", {{"extract", stage}}}}},
          {"work", {{"frames", 10}, {"solver_steps", steps}, {"allocations", nullptr}}},
          {"memory", {{"peak_mb", 80.0}}}};
}

TimeReport report_of(const std::vector<ordered_json>& summaries, const std::string& mode = "sequential") {
  return make_time_report({.version = "1",
                           .data = "walk",
                           .mode = mode,
                           .command = "bslam bench walk --time",
                           .processor = "P",
                           .instructions = "AVX2"},
                          summaries);
}

Change change_of(const TimeComparison& comparison, const std::string& name) {
  for (const ComparedFigure& f : comparison.figures) {
    if (f.name == name) return f.change;
  }
  ADD_FAILURE() << name;
  return Change::kNone;
}

TEST(TimeReport, HasTheMedianAndTheRangeOfTheRuns) {
  const TimeReport report = report_of({summary(5), summary(4), summary(9)});
  EXPECT_EQ(report.runs, 3);
  ASSERT_EQ(report.stages.size(), 1u);
  EXPECT_EQ(report.stages[0].name, "extract");
  EXPECT_EQ(report.stages[0].calls, 10);
  EXPECT_EQ(report.stages[0].median_ms, (Spread{5, 4, 9}));
  EXPECT_EQ(report.stages[0].total_ms, (Spread{50, 40, 90}));
  EXPECT_EQ(report.process[0].first, "frame_wall_median_ms");
  EXPECT_EQ(report.process[0].second, (Spread{10, 8, 18}));
  EXPECT_EQ(report.process[2].first, "frame_cpu_mean_ms");
  EXPECT_NEAR(report.process[2].second.median, 15, 1e-9);
  const std::vector<std::pair<std::string, std::int64_t>> work = {{"frames", 10}, {"solver_steps", 700}};
  EXPECT_EQ(report.work, work);
  EXPECT_TRUE(report.varying.empty());
  EXPECT_EQ(spread_of({1, 4}).median, 2.5);
}

TEST(TimeReport, NamesCountsThatDifferBetweenRuns) {
  const TimeReport report = report_of({summary(5, 700), summary(5, 710)});
  EXPECT_EQ(report.work.size(), 1u);
  ASSERT_EQ(report.varying.size(), 1u);
  EXPECT_EQ(report.varying[0], (VaryingCount{"solver_steps", 700, 710}));
}

TEST(TimeReport, IsReadAsItWasWritten) {
  const TimeReport report = report_of({summary(5, 700), summary(6, 710)});
  const auto read = parse_time_json(time_json(report), "time.json");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(*read, report);
}

TEST(TimeReport, NamesTheKeyThatCannotBeRead) {
  const std::string good = time_json(report_of({summary(5)}));
  const auto error = [&](const ordered_json::json_pointer& at, const ordered_json& value) {
    ordered_json changed = ordered_json::parse(good);
    changed[at] = value;
    const auto read = parse_time_json(changed.dump(), "old.json");
    return read ? std::string("read") : read.error().message();
  };
  const auto at = [](const char* pointer) { return ordered_json::json_pointer(pointer); };
  EXPECT_EQ(error(at("/runs"), "five"), "old.json: runs: found \"five\", expected a whole number");
  EXPECT_EQ(error(at("/stages/extract/median_ms"), 3),
            "old.json: stages.extract.median_ms: found 3, expected an object");
  EXPECT_EQ(error(at("/stages/extract/p95_ms/min"), nullptr),
            "old.json: stages.extract.p95_ms.min: found null, expected a number");
  EXPECT_EQ(error(at("/work/frames"), 1.5), "old.json: work.frames: found 1.5, expected a whole number");
  EXPECT_EQ(error(at("/bslam_time"), 2),
            "old.json: bslam_time: found 2, expected 1, the version of the file that this program reads");
  EXPECT_EQ(parse_time_json("{}", "old.json").error().message(),
            "old.json: bslam_time: found nothing, expected a whole number");
  EXPECT_FALSE(parse_time_json("[1, 2", "old.json"));
}

TEST(TimeComparison, MarksTimesThatAreSlowerThanTheMarginAndTheSpread) {
  const TimeReport before = report_of({summary(5), summary(5.2), summary(5.4)});
  const auto compared = [&](const std::vector<ordered_json>& now) {
    return change_of(compare_times(before, report_of(now), 0.1), "extract: median ms");
  };
  EXPECT_EQ(compared({summary(5), summary(5.2), summary(5.4)}), Change::kNone);
  EXPECT_EQ(compared({summary(5.5), summary(5.6), summary(5.6)}), Change::kNone);  // within 10 %
  EXPECT_EQ(compared({summary(5.3), summary(6.5), summary(6.6)}), Change::kNone);  // one run is as fast as before
  EXPECT_EQ(compared({summary(5.8), summary(6.5), summary(6.6)}), Change::kMore);
  EXPECT_EQ(compared({summary(4.1), summary(4.2), summary(4.3)}), Change::kLess);
  const TimeReport tiny = report_of({summary(0.01)});
  EXPECT_EQ(change_of(compare_times(tiny, report_of({summary(0.02)}), 0.1), "extract: median ms"), Change::kNone);
  EXPECT_TRUE(compare_times(before, report_of({summary(9)}), 0.1).worse());
  EXPECT_FALSE(compare_times(before, report_of({summary(9)}), 1.0).worse());
  EXPECT_FALSE(compare_times(before, report_of({summary(2)}), 0.1).worse());
}

TEST(TimeComparison, CountsAreComparedExactlyInSequentialMode) {
  const TimeReport before = report_of({summary(5, 700)}), now = report_of({summary(5, 701)});
  const TimeComparison comparison = compare_times(before, now, 0.1);
  EXPECT_EQ(change_of(comparison, "solver steps"), Change::kDiffers);
  EXPECT_EQ(change_of(comparison, "frames"), Change::kNone);
  EXPECT_TRUE(comparison.worse());
  const TimeComparison parallel =
      compare_times(report_of({summary(5, 700)}, "parallel"), report_of({summary(5, 701)}, "parallel"), 0.1);
  EXPECT_FALSE(parallel.worse());
  EXPECT_EQ(parallel.notes.size(), 1u);
  for (const auto& [first, second] : {std::pair("parallel", "sequential"), std::pair("sequential", "parallel")}) {
    const TimeComparison mixed =
        compare_times(report_of({summary(5, 700)}, first), report_of({summary(5, 701)}, second), 0.1);
    EXPECT_FALSE(mixed.worse()) << first;
    ASSERT_EQ(mixed.notes.size(), 1u) << first;
    EXPECT_NE(mixed.notes.front().find("mode parallel"), std::string::npos) << mixed.notes.front();
  }
}

TEST(TimeComparison, ShowsFiguresThatOnlyOneOfThemHas) {
  ordered_json other = summary(5);
  other["time"]["stages_ms"]["loop"] = other["time"]["stages_ms"]["extract"];
  const TimeReport without = report_of({summary(5)}), with = report_of({other});
  EXPECT_EQ(change_of(compare_times(without, with, 0.1), "loop: median ms"), Change::kNone);
  EXPECT_EQ(change_of(compare_times(with, without, 0.1), "loop: median ms"), Change::kNone);
  EXPECT_FALSE(compare_times(with, without, 0.1).worse());
}

}  // namespace
}  // namespace bslam::benchmark
