#include "base/option_table.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

namespace bslam {

enum class Pace { kFast, kRealtime };
template <>
struct EnumNames<Pace> {
  static constexpr std::array<EnumName<Pace>, 2> kNames{{{Pace::kFast, "fast"}, {Pace::kRealtime, "realtime"}}};
};

namespace {

struct InnerOptions {
  double sigma_px = 0.7;
  std::string name = "none";

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("sigma_px", self.sigma_px, Range{0.05, 5.0}, "px", "standard deviation");
    visitor("name", self.name, Range{}, "", "a name");
  }
};

struct OuterOptions {
  bool loop = true;
  int rounds = 4;
  InnerOptions inner;
  Pace pace = Pace::kFast;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("loop", self.loop, Range{}, "", "close loops");
    visitor("rounds", self.rounds, Range{1, 20}, "", "rounds");
    visitor.section("inner", self.inner);
    visitor("pace", self.pace, Range{}, "", "pace");
  }
};

TEST(OptionTable, ListsKeysInTheOrderOfVisit) {
  OuterOptions options;
  const OptionTable table(options);
  EXPECT_EQ(table.keys(), (std::vector<std::string>{"loop", "rounds", "inner.sigma_px", "inner.name", "pace"}));
  EXPECT_EQ(table.find("inner.sigma_px")->unit, "px");
  EXPECT_EQ(table.find("inner"), nullptr);
}

TEST(OptionTable, SetsEveryType) {
  OuterOptions options;
  OptionTable table(options);
  EXPECT_TRUE(table.set("loop", "false"));
  EXPECT_TRUE(table.set("rounds", "7"));
  EXPECT_TRUE(table.set("inner.sigma_px", "1e0"));
  EXPECT_TRUE(table.set("inner.name", "a b"));
  EXPECT_TRUE(table.set("pace", "realtime"));
  EXPECT_FALSE(options.loop);
  EXPECT_EQ(options.rounds, 7);
  EXPECT_EQ(options.inner.sigma_px, 1.0);
  EXPECT_EQ(options.inner.name, "a b");
  EXPECT_EQ(options.pace, Pace::kRealtime);
}

TEST(OptionTable, RejectsBadValuesAndKeepsTheOldOnes) {
  OuterOptions options;
  OptionTable table(options);
  for (const auto& [key, text] : {std::pair("loop", "maybe"),
                                  {"loop", ""},
                                  {"rounds", "0"},
                                  {"rounds", "21"},
                                  {"rounds", "3.5"},
                                  {"rounds", "99999999999"},
                                  {"rounds", "-5"},
                                  {"inner.sigma_px", "nan"},
                                  {"inner.sigma_px", "inf"},
                                  {"inner.sigma_px", "0.01"},
                                  {"inner.sigma_px", "wide"},
                                  {"pace", "sideways"}}) {
    const Status status = table.set(key, text);
    ASSERT_FALSE(status) << key << "=" << text;
    EXPECT_EQ(status.error().key, key);
  }
  EXPECT_EQ(options.rounds, 4);
  EXPECT_EQ(options.inner.sigma_px, 0.7);
}

TEST(OptionTable, ErrorsNameTheAcceptedValues) {
  OuterOptions options;
  OptionTable table(options);
  EXPECT_EQ(table.set("rounds", "0").error().message(), "rounds: found 0, expected an integer in [1, 20]");
  EXPECT_EQ(table.set("inner.sigma_px", "9").error().expected, "a number in [0.05, 5.0]");
  EXPECT_EQ(table.set("pace", "slow").error().expected, "one of: fast, realtime");
  EXPECT_EQ(table.set("inner.sigma", "1").error().message(),
            "unknown setting 'inner.sigma'; did you mean 'inner.sigma_px'?");
  EXPECT_EQ(table.set("frobnication", "1").error().message(),
            "unknown setting 'frobnication'; 'bslam settings --common' lists the commonly changed settings");
}

TEST(OptionTable, ValuesRoundTripExactly) {
  OuterOptions options;
  options.inner.sigma_px = 0.1 + 0.2;
  OptionTable table(options);
  for (const Option& option : table.options()) EXPECT_TRUE(table.set(option.key, value_text(option)));
  EXPECT_EQ(options.inner.sigma_px, 0.1 + 0.2);
}

struct RenamedOptions {
  int new_name = 1, other = 2;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("new_name", self.new_name, Range{0, 9}, "", "", OptionNote{.common = true, .formerly = "old_name"});
    visitor("other", self.other, Range{}, "", "");
  }
};

struct RenamedInSection {
  RenamedOptions section;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor.section("section", self.section);
  }
};

TEST(OptionTable, AcceptsAFormerNameWithAWarning) {
  RenamedInSection options;
  OptionTable table(options);
  EXPECT_EQ(table.keys(), (std::vector<std::string>{"section.new_name", "section.other"}));
  ASSERT_TRUE(table.set("section.new_name", "3"));
  EXPECT_TRUE(table.warnings().empty());
  ASSERT_TRUE(table.set("section.old_name", "4"));
  ASSERT_TRUE(table.set("section.old_name", "5"));
  EXPECT_EQ(options.section.new_name, 5);
  EXPECT_EQ(table.warnings(), std::vector<std::string>{
                                  "setting 'section.old_name' is now called 'section.new_name'; the old name will stop "
                                  "working in the next release"});
  EXPECT_EQ(table.set("section.old_name", "10").error().key, "section.new_name");
}

TEST(OptionTable, MarksTheCommonOptions) {
  RenamedInSection options;
  const OptionTable table(options);
  EXPECT_TRUE(table.find("section.new_name")->common);
  EXPECT_FALSE(table.find("section.other")->common);
}

struct TwiceOptions {
  int a = 0;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("a", self.a, Range{}, "", "");
    visitor("a", self.a, Range{}, "", "");
  }
};

TEST(OptionTableDeathTest, RejectsAKeyDeclaredTwice) {
  TwiceOptions options;
  EXPECT_DEATH(OptionTable{options}, "declared once");
}

}  // namespace
}  // namespace bslam
