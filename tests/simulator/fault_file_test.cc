#include "simulator/fault_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace bslam::simulator {
namespace {

class FaultFile : public testing::Test {
 protected:
  ~FaultFile() override { std::filesystem::remove(file_); }

  Result<std::vector<Fault>> read(const std::string& text, std::size_t num_cameras = 4) {
    std::ofstream(file_) << text;
    return read_faults(file_, num_cameras);
  }

  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("bslam_faults_" + std::to_string(::getpid()) + ".yaml");
};

TEST_F(FaultFile, ReadsYaml) {
  const auto faults = read(
      "- {type: black, cameras: [1, 3], from: 0.5, to: 2}\n"
      "- type: delayed\n  cameras: [0]\n  from: 3\n  to: 4\n  delay_s: 0.25\n");
  ASSERT_TRUE(faults.ok());
  ASSERT_EQ(faults->size(), 2u);
  EXPECT_EQ((*faults)[0].type, FaultType::kBlack);
  EXPECT_EQ((*faults)[0].cameras, (std::vector<int>{1, 3}));
  EXPECT_EQ((*faults)[0].to_s, 2.0);
  EXPECT_EQ((*faults)[1].delay_s, 0.25);
}

TEST_F(FaultFile, ReadsJson) {
  const auto faults = read(R"([{"type": "over_exposed", "cameras": [0], "from": 0, "to": 1}])");
  ASSERT_TRUE(faults.ok());
  EXPECT_EQ((*faults)[0].type, FaultType::kOverExposed);
  EXPECT_TRUE(read("[]").value().empty());
}

TEST_F(FaultFile, RejectsInvalidFaults) {
  const char* const wrong[] = {
      "{type: black}",
      "- {type: blakc, cameras: [1], from: 0, to: 1}",
      "- {type: black, cameras: [4], from: 0, to: 1}",
      "- {type: black, cameras: [-1], from: 0, to: 1}",
      "- {type: black, cameras: [0.5], from: 0, to: 1}",
      "- {type: black, cameras: [], from: 0, to: 1}",
      "- {type: black, cameras: [0], from: 1, to: 1}",
      "- {type: black, cameras: [0], from: -1, to: 1}",
      "- {type: black, cameras: [0], from: 0}",
      "- {type: black, cameras: [0], from: 0, to: .nan}",
      "- {type: black, cameras: [0], from: 0, to: 1, delay_s: 0.1}",
      "- {type: delayed, cameras: [0], from: 0, to: 1, delay_s: -0.1}",
      "- {type: black, cameras: [0], from: 0, to: 1, until: 3}",
      "- black",
      "- {type: black, cameras: [0",
      "",
  };
  for (const char* text : wrong) {
    const auto faults = read(text);
    ASSERT_FALSE(faults.ok()) << text;
    EXPECT_EQ(faults.error().file, file_.string()) << text;
  }
  EXPECT_FALSE(read_faults("/nowhere/faults.yaml", 4).ok());
}

}  // namespace
}  // namespace bslam::simulator
