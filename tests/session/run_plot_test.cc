#include "session/run_plot.h"

#include <gtest/gtest.h>

#include "report/well_formed_xml.h"

namespace bslam::session {
namespace {

using report::xml_fault;
using tracking::CameraReason, tracking::CameraState;

constexpr tracking::CameraStatus kOk, kFrozen{CameraState::kOut, CameraReason::kFrozen},
    kNoImages{CameraState::kOut, CameraReason::kNoImages};

RunRecord short_run(int frames) {
  RunRecord record;
  record.data = "A <quad> & more";
  record.mode = "sequential";
  record.cameras = {{"front", frames, 0, {}}, {"rear", frames, 0, {}}};
  for (int i = 0; i < frames; ++i) {
    const double time_s = 0.05 * i;
    tracking::FrameRecord frame;
    frame.keyframe = i % 5 == 0;
    frame.frame_ms = 20.0 + i % 3;
    frame.images = {image::ImageState::kPresent,
                    i % 2 == 0 ? image::ImageState::kPresent : image::ImageState::kMissing};
    frame.result.cameras = {{1000 + i, 300, 250}, {900, 200, 100}};
    const bool lost = i >= 10 && i < 15;
    frame.result.status = lost ? tracking::TrackStatus::kLost : tracking::TrackStatus::kTracking;
    add_stage_sample(record, "extract", StageThread::kCaller, {time_s, 9.0});
    if (frame.keyframe) add_stage_sample(record, "local adjustment", StageThread::kBackground, {time_s, 50.0});
    record.frames.push_back({time_s, std::move(frame)});
  }
  record.loops = {{0.9, 0.1, 50}};
  return record;
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(RunPlot, NamesCamerasStagesAndEvents) {
  const std::string svg = run_plot_svg(short_run(40));
  EXPECT_EQ(xml_fault(svg), "");
  for (const char* word : {"front", "rear", "extract", "local adjustment", "keyframe", "loop closed", "lost",
                           "35 of 40 frames tracked", "A &lt;quad&gt; &amp; more"}) {
    EXPECT_TRUE(contains(svg, word)) << word;
  }
  EXPECT_FALSE(contains(svg, "nan"));
  EXPECT_FALSE(contains(svg, "relocalised"));
}

std::size_t count(const std::string& text, std::string_view part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

// Two cells of one camera have enough observations for an arrow.
TEST(RunPlot, ShowsMeanResidualsOverTheImage) {
  RunRecord record = short_run(40);
  EXPECT_FALSE(contains(run_plot_svg(record), "rms"));
  calibration::ImageResiduals& r = record.cameras[1].residuals;
  r = {.width = 640, .height = 480, .observations = 45, .rms_px = 0.46, .cells = {}};
  r.cells.resize(calibration::ImageResiduals::kColumns * calibration::ImageResiduals::kRows);
  r.cells[0] = {{0.3, 0.4}, 20};
  r.cells[50] = {{-0.3, 0.0}, 20};
  r.cells[51] = {{9.0, 9.0}, 5};  // too few
  const std::string svg = run_plot_svg(record);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_TRUE(contains(svg, "rear: residuals, rms 0.46 px"));
  EXPECT_TRUE(contains(svg, "0.2 px")) << "the scale bar";
  EXPECT_FALSE(contains(svg, "front: residuals"));
  EXPECT_FALSE(contains(svg, "nan"));
}

TEST(RunPlot, ShowsCameraFaultsByCamera) {
  constexpr std::string_view kBar = "stroke-width=\"6";
  const std::string without_faults = run_plot_svg(short_run(40));
  RunRecord record = short_run(40);
  record.cameras[1].states = {{kOk, 0.0, 0.5}, {kFrozen, 0.55, 1.0}, {kOk, 1.05, 1.95}};
  const std::string svg = run_plot_svg(record);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_TRUE(contains(svg, "Camera faults"));
  EXPECT_TRUE(contains(svg, "out: frozen"));
  EXPECT_GT(count(svg, kBar), count(without_faults, kBar));
  EXPECT_GT(count(svg, ">rear<"),
            count(without_faults, ">rear<"));  // the tick of the camera, in addition to the legends
  EXPECT_FALSE(contains(without_faults, "Camera faults"));
  record.cameras[1].states = {{kOk, 0.0, 1.95}};
  EXPECT_EQ(run_plot_svg(record), without_faults);
  record.frames.clear();
  record.cameras[1].states = {{kFrozen, 0.55, 1.0}};
  EXPECT_EQ(xml_fault(run_plot_svg(record)), "");
}

TEST(RunPlot, IsDeterministic) { EXPECT_EQ(run_plot_svg(short_run(40)), run_plot_svg(short_run(40))); }

TEST(RunPlot, IsSmallForALongRun) {
  RunRecord record = short_run(20000);
  for (int i = 0; i < 10000; ++i) {  // a camera whose status changes often
    record.cameras[1].states.push_back({i % 2 == 0 ? kOk : kNoImages, 0.1 * i, 0.1 * i + 0.05});
  }
  const std::string svg = run_plot_svg(record);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_LT(svg.size(), 1'000'000u);
  EXPECT_TRUE(contains(svg, "frame, maximum"));
}

TEST(RunPlot, DrawsAnEmptyRun) {
  EXPECT_EQ(xml_fault(run_plot_svg({})), "");
  EXPECT_EQ(xml_fault(run_plot_svg(short_run(1))), "");
}

}  // namespace
}  // namespace bslam::session
