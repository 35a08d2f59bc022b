#include "system/config.h"

#include <gtest/gtest.h>

#include <set>

#include "base/option_table.h"

namespace bslam::system {
namespace {

// Another value the option takes; empty where the range leaves none.
std::string other_value(const Option& option) {
  if (const auto* flag = std::get_if<bool*>(&option.field)) return **flag ? "false" : "true";
  if (const auto* number = std::get_if<int*>(&option.field))
    return std::to_string(**number + (**number + 1 <= option.range.high ? 1 : -1));
  if (const auto* number = std::get_if<double*>(&option.field)) {
    const double up = 1.0625 * **number + 0.001;
    return std::to_string(up <= option.range.high ? up : 0.5 * (option.range.low + **number));
  }
  if (const auto* text = std::get_if<std::string*>(&option.field)) return **text + "x";
  const auto& names = std::get<EnumField>(option.field);
  return std::string(names.names[static_cast<std::size_t>(names.get(names.field) + 1) % names.names.size()]);
}

TEST(Config, EveryOptionSurvivesAsText) {
  Config changed, copy;
  OptionTable from(changed), to(copy);
  EXPECT_GT(from.options().size(), 60u);
  for (const Option& option : from.options()) {
    const std::string before = value_text(option);
    ASSERT_TRUE(from.set(option.key, other_value(option)).ok()) << option.key;
    EXPECT_NE(value_text(option), before) << option.key;
  }
  for (const Option& option : from.options()) ASSERT_TRUE(to.set(option.key, value_text(option)).ok()) << option.key;
  for (const Option& option : from.options())
    EXPECT_EQ(value_text(*to.find(option.key)), value_text(option)) << option.key;
}

TEST(Config, DefaultsLieWithinTheirRangesAndKeysAreUnique) {
  Config config;
  OptionTable table(config);
  std::set<std::string> keys;
  for (const Option& option : table.options()) {
    EXPECT_TRUE(keys.insert(option.key).second) << option.key;
    EXPECT_TRUE(table.set(option.key, value_text(option)).ok()) << option.key;
    EXPECT_FALSE(option.help.empty()) << option.key;
  }
}

TEST(Config, ReadsTheModeByName) {
  Config config;
  OptionTable table(config);
  ASSERT_TRUE(table.set("mode", "sequential").ok());
  EXPECT_EQ(config.mode, execution::Mode::kSequential);
  ASSERT_TRUE(table.set("mode", "lagged").ok());
  EXPECT_EQ(config.mode, execution::Mode::kLagged);
  ASSERT_TRUE(table.set("mode", "parallel").ok());
  EXPECT_EQ(config.mode, execution::Mode::kParallel);
  EXPECT_FALSE(table.set("mode", "sometimes").ok());
  EXPECT_EQ(config.mode, execution::Mode::kParallel);
}

}  // namespace
}  // namespace bslam::system
