#include "system/config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "base/option_table.h"

namespace bslam::system {
namespace {

// Another valid value of the option; empty if there is none.
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

TEST(Config, EveryOptionIsReproducedFromItsText) {
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

// Options and defaults in the tables of docs/settings.md; units follow the defaults after a space.
std::map<std::string, std::string> documented_settings() {
  std::map<std::string, std::string> settings;
  std::ifstream page(std::filesystem::path(BSLAM_SOURCE_DIR) / "docs/settings.md");
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| `")) continue;
    const std::size_t end = line.find("` | ");
    std::istringstream rest(line.substr(end + 4));
    rest >> settings[line.substr(3, end - 3)];
  }
  return settings;
}

TEST(Config, TheSettingsPageListsTheCommonOptionsWithTheirDefaults) {
  std::map<std::string, std::string> documented = documented_settings();
  Config config;
  const OptionTable table(config);
  for (const Option& option : table.options()) {
    if (!option.common) continue;
    const auto found = documented.find(option.key);
    ASSERT_NE(found, documented.end()) << option.key << " is missing on the page";
    const auto value = parse_double(value_text(option)), shown = parse_double(found->second);
    EXPECT_TRUE(value && shown ? *value == *shown : value_text(option) == found->second)
        << option.key << ": " << found->second << " instead of " << value_text(option);
    documented.erase(found);
  }
  for (const auto& [key, value] : documented) ADD_FAILURE() << key << " is not a common option";
}

TEST(Config, FormerNamesAreNotInUse) {
  Config config;
  OptionTable table(config);
  const std::vector<std::string> keys = table.keys();
  for (const Option& option : table.options()) {
    if (option.former_key.empty()) continue;
    EXPECT_EQ(std::ranges::count(keys, option.former_key), 0) << option.former_key;
    EXPECT_TRUE(table.set(option.former_key, value_text(option)).ok()) << option.former_key;
  }
  EXPECT_FALSE(table.warnings().empty());
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
