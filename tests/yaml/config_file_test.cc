#include "yaml/config_file.h"

#include <gtest/gtest.h>

#include <array>

#include "support/data_on_disk.h"

namespace bslam {

enum class Late { kBlock, kDrop };
template <>
struct EnumNames<Late> {
  static constexpr std::array<EnumName<Late>, 2> kNames{{{Late::kBlock, "block"}, {Late::kDrop, "drop"}}};
};

namespace yaml {
namespace {

struct Deep {
  double gain = 1.5;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("gain", self.gain, Range{-100, 100}, "1/s", "gain of the deep part");
  }
};

struct Features {
  int per_image = 1200;
  Deep deep;
  bool mask = false;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("per_image", self.per_image, Range{50, 20000}, "", "number of keypoints per image",
            OptionNote{.common = true, .formerly = "per_image_old"});
    visitor.section("deep", self.deep);
    visitor("mask", self.mask, Range{}, "", "use masks");
  }
};

struct Settings {
  Features features;
  Late late = Late::kBlock;
  std::string vocabulary = "";
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor.section("features", self.features);
    visitor("late", self.late, Range{}, "", "what to do with late frames");
    visitor("vocabulary", self.vocabulary, Range{}, "", "file");
  }
};

class ConfigFile : public testing::Test {
 protected:
  Status apply(std::string_view yaml) {
    support::write_text(folder_.path() / "config.yaml", yaml);
    return apply_config_file(table_, folder_.path() / "config.yaml");
  }
  support::TemporaryFolder folder_;
  Settings settings_;
  OptionTable table_{settings_};
};

TEST_F(ConfigFile, AcceptsNestedMapsAndDottedKeys) {
  ASSERT_TRUE(apply("features:\n  per_image: 800\n  deep.gain: 2.5\nfeatures.mask: true\nlate: drop\n"));
  EXPECT_EQ(settings_.features.per_image, 800);
  EXPECT_EQ(settings_.features.deep.gain, 2.5);
  EXPECT_TRUE(settings_.features.mask);
  EXPECT_EQ(settings_.late, Late::kDrop);
}

TEST_F(ConfigFile, KeepsSettingsThatAreNotInTheFile) {
  ASSERT_TRUE(apply(""));
  ASSERT_TRUE(apply("# only words\n"));
  ASSERT_TRUE(apply("features:\n  # per_image: 7\nlate: drop\n"));
  EXPECT_EQ(settings_.features.per_image, 1200);
}

TEST_F(ConfigFile, ErrorsNameFileKeyAndValue) {
  struct Case {
    const char *yaml, *key, *found;
  };
  for (const Case& c : {Case{"features:\n  per_imge: 1\n", "features.per_imge", "an unknown key"},
                        Case{"features:\n  per_image: -5\n", "features.per_image", "-5"},
                        Case{"features:\n  per_image: many\n", "features.per_image", "many"},
                        Case{"features:\n  per_image: [1]\n", "features.per_image", "a list of 1"},
                        Case{"features:\n  per_image: {a: 1}\n", "features.per_image", "a map"},
                        Case{"features:\n  deep:\n    gain: .nan\n", "features.deep.gain", ".nan"},
                        Case{"features: 3\n", "features", "3"}, Case{"late: 5\n", "late", "5"},
                        Case{"late: block\nlate: drop\n", "late", "a repeated key"},
                        Case{"features:\n  mask: true\nfeatures.mask: false\n", "features.mask", "a repeated key"}}) {
    const Status status = apply(c.yaml);
    ASSERT_FALSE(status) << c.yaml;
    EXPECT_EQ(status.error().file, (folder_.path() / "config.yaml").string());
    EXPECT_EQ(status.error().key, c.key);
    EXPECT_EQ(status.error().found, c.found);
  }
  EXPECT_EQ(apply("features:\n  per_imge: 1\n").error().message(),
            (folder_.path() / "config.yaml").string() +
                ": unknown setting 'features.per_imge'; did you mean 'features.per_image'?");
}

TEST_F(ConfigFile, RejectsDocumentsThatAreNotMaps) {
  EXPECT_EQ(apply("a: 1\nb: [1, 2\n c}").error().key, "line 3");
  EXPECT_FALSE(apply("- a\n- b\n"));
  EXPECT_FALSE(apply("words"));
  EXPECT_FALSE(apply("&a {features: *a}"));  // a cycle
  EXPECT_FALSE(apply_config_file(table_, folder_.path() / "none.yaml"));
}

TEST_F(ConfigFile, RoundTripsExactly) {
  settings_.features.deep.gain = 0.1 + 0.2;
  settings_.features.per_image = 777;
  settings_.late = Late::kDrop;
  settings_.vocabulary = "a \"quoted\" \\ path: # with\nlines and äöü";
  const std::string text = config_to_yaml(table_);
  Settings other;
  OptionTable other_table(other);
  support::write_text(folder_.path() / "out.yaml", text);
  const Status status = apply_config_file(other_table, folder_.path() / "out.yaml");
  ASSERT_TRUE(status) << status.error().message();
  EXPECT_EQ(other.features.deep.gain, 0.1 + 0.2);
  EXPECT_EQ(other.features.per_image, 777);
  EXPECT_EQ(other.late, Late::kDrop);
  EXPECT_EQ(other.vocabulary, settings_.vocabulary);
  EXPECT_EQ(config_to_yaml(other_table), text);
}

TEST_F(ConfigFile, DescribesEverySetting) {
  EXPECT_EQ(config_to_yaml(table_),
            "features:\n"
            "  per_image: 1200  # number of keypoints per image; an integer in [50, 20000]\n"
            "  deep:\n"
            "    gain: 1.5  # [advanced] gain of the deep part; 1/s; a number in [-100.0, 100.0]\n"
            "  mask: false  # [advanced] use masks; true or false\n"
            "late: block  # [advanced] what to do with late frames; one of: block, drop\n"
            "vocabulary: \"\"  # [advanced] file; text\n");
}

TEST_F(ConfigFile, PrintsOnlyTheCommonSettings) {
  EXPECT_EQ(config_to_yaml(table_, Selection::kCommon),
            "features:\n"
            "  per_image: 1200  # number of keypoints per image; an integer in [50, 20000]\n");
}

TEST_F(ConfigFile, AcceptsFormerNamesWithAWarning) {
  ASSERT_TRUE(apply("features:\n  per_image_old: 800\n"));
  EXPECT_EQ(settings_.features.per_image, 800);
  ASSERT_EQ(table_.warnings().size(), 1u);
  EXPECT_NE(table_.warnings()[0].find("'features.per_image_old' is now called 'features.per_image'"),
            std::string::npos);
  EXPECT_TRUE(apply_setting(table_, "features.per_image_old=900"));
  EXPECT_EQ(settings_.features.per_image, 900);
  EXPECT_EQ(apply("features:\n  per_image_old: 800\n  per_image: 700\n").error().found, "a repeated key");
}

TEST_F(ConfigFile, SettingsOfTheCommandLine) {
  EXPECT_TRUE(apply_setting(table_, "features.per_image=900"));
  EXPECT_TRUE(apply_setting(table_, "vocabulary=a=b"));
  EXPECT_EQ(settings_.features.per_image, 900);
  EXPECT_EQ(settings_.vocabulary, "a=b");
  for (const char* bad : {"", "features.per_image", "=5", "no.such.key=1", "features.per_image=-5", "features=1"}) {
    const Status status = apply_setting(table_, bad);
    ASSERT_FALSE(status) << bad;
    EXPECT_EQ(status.error().file, "--set");
  }
}

}  // namespace
}  // namespace yaml
}  // namespace bslam
