#include "report/rig_plot.h"

#include <gtest/gtest.h>

#include "camera/test_cameras.h"
#include "report/well_formed_xml.h"

namespace bslam::report {
namespace {

using geometry::SE3;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

camera::Rig rig_of_every_model() {
  std::vector<camera::RigCamera> cameras;
  for (const camera::Camera& camera : camera::test_cameras()) {
    const double k = static_cast<double>(cameras.size());
    cameras.push_back({camera, SE3(geometry::so3_exp({0, 0.4 * k, 0}), {0.05 * k, 0.01 * k, 0})});
  }
  cameras[1].camera.name = "<left> & \"right\"";
  return camera::Rig(std::move(cameras));
}

TEST(RigPlot, DrawsEveryCameraInBothViews) {
  const camera::Rig rig = rig_of_every_model();
  const std::string svg = rig_plot_svg(rig);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_EQ(count(svg, "<circle"), 2 * rig.size());
  EXPECT_EQ(count(svg, ">&lt;left&gt; &amp; &quot;right&quot;<"), 2u);
  EXPECT_EQ(count(svg, ">body<"), 0u);  // camera 0 is the body
  EXPECT_EQ(count(svg, "nan"), 0u);
  EXPECT_EQ(svg, rig_plot_svg(rig));
}

TEST(RigPlot, DrawsOneCameraAndItsBody) {
  const camera::Rig rig({{camera::test_cameras()[0], SE3(geometry::so3_exp({0.1, 0, 0}), {0, 0, 0.2})}});
  const std::string svg = rig_plot_svg(rig);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_EQ(count(svg, ">body<"), 2u);
  EXPECT_EQ(count(svg, "nan"), 0u);
}

}  // namespace
}  // namespace bslam::report
