#include "base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace bslam {
namespace {

TEST(Error, MessageNamesFileKeyFoundAndExpectedInOneLine) {
  EXPECT_EQ((Error{"rig.yaml", "cameras[0].model", "telepathic", "pinhole"}.message()),
            "rig.yaml: cameras[0].model: found telepathic, expected pinhole");
}

TEST(Error, MessageUsesTheSentenceWithoutRepetition) {
  EXPECT_EQ((Error{"rig.yaml", "cameras", "", "", "every camera needs a name"}.message()),
            "rig.yaml: cameras: every camera needs a name");
  EXPECT_EQ((Error{"a.yaml", "", "No such file", "a file", "cannot open a.yaml: No such file"}.message()),
            "cannot open a.yaml: No such file");
}

TEST(Error, MessageOmitsEmptyFields) {
  EXPECT_EQ((Error{"f", "", "nothing", ""}.message()), "f: found nothing");
  EXPECT_EQ((Error{"", "k", "", "a number"}.message()), "k: expected a number");
}

TEST(Error, MessageIsOneLineWithoutControlCharacters) {
  const std::string message = Error{"f", "k", "a\nb\r\tc\x1b[31m", "d"}.message();
  for (const char c : message) EXPECT_GE(static_cast<unsigned char>(c), 0x20);
}

TEST(Result, HoldsAValueOrAnError) {
  const Result<int> good = 3;
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 3);
  const Result<int> bad = Error{"f", "k", "x", "y"};
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().key, "k");
}

TEST(Result, HoldsMoveOnlyTypes) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(5);
  const std::unique_ptr<int> taken = *std::move(result);
  EXPECT_EQ(*taken, 5);
}

TEST(Status, IsOkUnlessGivenAnError) {
  EXPECT_TRUE(Status().ok());
  const Status bad = Error{"f", "", "x", ""};
  EXPECT_FALSE(bad);
  EXPECT_EQ(bad.error().found, "x");
}

TEST(ResultDeathTest, AbortsOnAccessToTheAbsentAlternative) {
  const Result<int> bad = Error{"f", "", "x", ""};
  EXPECT_DEATH(static_cast<void>(bad.value()), "holds an error");
  const Result<int> good = 1;
  EXPECT_DEATH(static_cast<void>(good.error()), "holds a value");
}

}  // namespace
}  // namespace bslam
