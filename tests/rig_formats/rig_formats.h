// Test fixture for calibration formats: a temporary folder with a calibration, and functions that read it.
#pragma once

#include <gtest/gtest.h>

#include "rig_formats/rig_file.h"
#include "support/data_on_disk.h"

namespace bslam::rig_formats {

namespace fs = std::filesystem;
using geometry::SE3;
using geometry::Vector2d;
using geometry::Vector3d;

// `camera(index(0))`: a literal 0 would also convert to a name.
inline std::size_t index(std::size_t i) { return i; }

class RigFormats : public testing::Test {
 protected:
  Result<RigFile> read(const std::string& text, const std::string& name = "rig.yaml") {
    support::write_text(folder_.path() / name, text);
    return read_rig_file(folder_.path() / name);
  }
  Result<RigFile> read_with(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return read(text.replace(at, from.size(), to));
  }
  support::TemporaryFolder folder_;
};

}  // namespace bslam::rig_formats
