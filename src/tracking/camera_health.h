// Which cameras deliver pictures worth looking at. Judged before anything is extracted, from the pictures alone.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/options.h"
#include "image/image_bundle.h"
#include "tracking/camera_status.h"

namespace bslam::tracking {

struct HealthOptions {
  int dark_level = 16;        // grey value; a picture with hardly anything above it is black
  int bright_level = 250;     // grey value; a picture mostly above it is over-exposed
  double dark_share = 0.995;  // of the pixels
  double bright_share = 0.6;
  double sharp_slope =
      0.28;  // share of an edge's contrast that a sharp one has between two pixels; Gaussian blur of 3 px leaves 0.27
  double sharp_share = 0.1;  // of the edges; with fewer sharp ones a picture is blurred
  int readmit_after = 3;     // good pictures in a row before a camera that was out counts again, while there are others

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("dark_level", self.dark_level, Range{0, 255}, "",
            "grey value: a picture with hardly anything above it is black");
    visitor("bright_level", self.bright_level, Range{0, 255}, "",
            "grey value: a picture mostly above it is over-exposed");
    visitor("dark_share", self.dark_share, Range{0, 1}, "", "of the pixels, that makes a picture black");
    visitor("bright_share", self.bright_share, Range{0, 1}, "", "of the pixels, that makes a picture over-exposed");
    visitor("sharp_slope", self.sharp_slope, Range{0, 1}, "",
            "share of an edge's contrast that a sharp one has between two pixels");
    visitor("sharp_share", self.sharp_share, Range{0, 1}, "",
            "of the edges; with fewer sharp ones a picture is blurred");
    visitor("readmit_after", self.readmit_after, Range{1, 1000}, "",
            "good pictures in a row before a camera that was out counts again");
  }
};

// What the pictures of a frame say about the cameras; one entry per camera.
struct PictureFaults {
  std::vector<CameraReason> outage;   // why it is left out of the frame; kNone: it is used
  std::vector<std::uint8_t> blurred;  // out of focus or smeared; used all the same
  std::vector<std::uint8_t> failing;  // out, and not only without an image as slow cameras are now and then
};

class CameraMonitor {
 public:
  CameraMonitor(std::size_t cameras, const HealthOptions& options);

  // Looks at the pictures of the next frame: judge() and blurred(). `images`: one per camera.
  PictureFaults examine(const image::ImageBundle& images);

  // Why each camera is left out of the next frame. A picture is frozen where it is to the byte the last one of its
  // camera while another camera's has changed: a rig that stands still freezes nobody, and one camera alone cannot
  // tell. A camera without a picture is out for that frame and counts again with its next. Where all others are out as
  // well, one with a good picture counts at once.
  std::vector<CameraReason> judge(const image::ImageBundle& images);
  // Per camera: out of focus or behind something that smears, told from how steep the edges of its picture are, in
  // rows and columns, so that motion to one side is not blur. Such a camera is used, with what it has. A picture with
  // few edges says nothing; a camera was blurred until `readmit_after` pictures in a row are sharp.
  std::vector<std::uint8_t> blurred(const image::ImageBundle& images);

 private:
  struct Camera {
    std::optional<std::uint64_t> last;          // content of its last picture
    CameraReason outage = CameraReason::kNone;  // why it was out
    int good = 0;                               // pictures since
    bool blurred = false;
    int sharp = 0;   // pictures since it was
    int missed = 0;  // frames since its last picture
  };
  const HealthOptions options_;
  std::vector<Camera> cameras_;
};

}  // namespace bslam::tracking
