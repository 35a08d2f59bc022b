#include "camera/model_table.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bslam::camera {
namespace {

// Values within the bounds of `row` that describe a lens of moderate distortion.
std::vector<double> moderate(const ModelRow& row, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    const ModelParameter& p = row.parameters[i];
    values.push_back(std::isfinite(p.low) ? p.low + 0.3 * std::min(p.high - p.low, 2.0) : 0.01);
  }
  return values;
}

TEST(ModelTable, HasARowForEachAlternativeInItsOrder) {
  ASSERT_EQ(model_table().size(), std::variant_size_v<CameraModel>);
  for (std::size_t i = 0; i < model_table().size(); ++i) {
    const ModelRow& row = model_table()[i];
    const CameraModel model = row.make({400, 410, 320, 240}, moderate(row, row.counts.front()));
    EXPECT_EQ(model.index(), i) << row.name;
    EXPECT_EQ(model_name(model), row.name);
    EXPECT_EQ(find_model(row.name), &row);
  }
}

TEST(ModelTable, ModelsReturnTheirParameters) {
  for (const ModelRow& row : model_table()) {
    for (const std::size_t count : row.counts) {
      ASSERT_LE(count, row.parameters.size()) << row.name;
      const std::vector<double> values = moderate(row, count);
      const CameraModel model = row.make({400, 410, 320, 240}, values);
      EXPECT_EQ(distortion(model), values) << row.name;
      EXPECT_EQ(intrinsics(model).fy, 410) << row.name;
    }
  }
}

TEST(ModelTable, ParametersHaveBounds) {
  const ModelRow* model = find_model("double-sphere");
  ASSERT_NE(model, nullptr);
  EXPECT_FALSE(model->parameters[0].allows(-1));
  EXPECT_TRUE(model->parameters[0].allows(1));
  EXPECT_TRUE(model->parameters[1].allows(0));
  EXPECT_FALSE(model->parameters[1].allows(1.01));
  EXPECT_FALSE(model->parameters[1].allows(std::nan("")));
  EXPECT_EQ(find_model("fisheye"), nullptr);
}

}  // namespace
}  // namespace bslam::camera
