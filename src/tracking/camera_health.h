// Which cameras deliver pictures worth looking at. Judged before anything is extracted, from the pictures alone.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/options.h"
#include "image/image_bundle.h"

namespace bslam::tracking {

struct HealthOptions {
  int dark_level = 16;        // grey value; a picture with hardly anything above it is black
  int bright_level = 250;     // grey value; a picture mostly above it is over-exposed
  double black_pixel_ratio = 0.995;  // of the pixels
  double over_exposed_pixel_ratio = 0.6;
  double sharp_slope =
      0.28;  // share of an edge's contrast that a sharp one has between two pixels; Gaussian blur of 3 px leaves 0.27
  double min_sharp_edge_ratio = 0.1;  // of the edges; with fewer sharp ones a picture is blurred
  int readmit_after = 3;     // good pictures in a row before a camera that was out counts again, while there are others

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("dark_level", self.dark_level, Range{0, 255}, "",
            "grey value: a picture with hardly anything above it is black", kCommon);
    visitor("bright_level", self.bright_level, Range{0, 255}, "",
            "grey value: a picture mostly above it is over-exposed", kCommon);
    visitor("black_pixel_ratio", self.black_pixel_ratio, Range{0, 1}, "", "of the pixels, that makes a picture black",
            OptionNote{.formerly = "dark_share"});
    visitor("over_exposed_pixel_ratio", self.over_exposed_pixel_ratio, Range{0, 1}, "",
            "of the pixels, that makes a picture over-exposed", OptionNote{.formerly = "bright_share"});
    visitor("sharp_slope", self.sharp_slope, Range{0, 1}, "",
            "share of an edge's contrast that a sharp one has between two pixels");
    visitor("min_sharp_edge_ratio", self.min_sharp_edge_ratio, Range{0, 1}, "",
            "of the edges; with fewer sharp ones a picture is blurred", OptionNote{.formerly = "sharp_share"});
    visitor("readmit_after", self.readmit_after, Range{1, 1000}, "",
            "good pictures in a row before a camera that was out counts again");
  }
};

// Why a camera is out; kNone = it is not. kInconsistent is tracking's word, the others are known from the pictures.
enum class Outage : std::uint8_t { kNone, kNoImage, kBlack, kOverExposed, kFrozen, kInconsistent };

std::string_view describe(Outage outage);  // as in the summary: "", "no-images", "black", ...

class CameraMonitor {
 public:
  CameraMonitor(std::size_t cameras, const HealthOptions& options);

  // One per camera, for the pictures of the next frame. A picture is frozen where it is to the byte the last one of its
  // camera while another camera's has changed: a rig that stands still freezes nobody, and one camera alone cannot
  // tell. A camera without a picture is out for that frame and counts again with its next. Where all others are out as
  // well, one with a good picture counts at once.
  std::vector<Outage> judge(const image::ImageBundle& images);
  // One per camera: out of the frame judged last, and not only without a picture as slow cameras are now and then.
  std::span<const std::uint8_t> failing() const { return failing_; }

  // One per camera: out of focus or behind something that smears, told from how steep the edges of its picture are, in
  // rows and columns, so that motion to one side is not blur. Such a camera is used, with what it has. A picture with
  // few edges says nothing; a camera was blurred until `readmit_after` pictures in a row are sharp.
  std::vector<std::uint8_t> blurred(const image::ImageBundle& images);

 private:
  struct Camera {
    std::optional<std::uint64_t> last;  // content of its last picture
    Outage outage = Outage::kNone;      // why it was out
    int good = 0;                       // pictures since
    bool blurred = false;
    int sharp = 0;   // pictures since it was
    int missed = 0;  // frames since its last picture
  };
  std::vector<Outage> outages(const image::ImageBundle& images);
  const HealthOptions options_;
  std::vector<Camera> cameras_;
  std::vector<std::uint8_t> failing_;
};

}  // namespace bslam::tracking
