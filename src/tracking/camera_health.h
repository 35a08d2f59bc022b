// Checks the images of each camera before features are extracted: black, over-exposed, frozen, blurred.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/thread_pool.h"
#include "image/image_bundle.h"
#include "tracking/camera_status.h"
#include "tracking/still_views.h"

namespace bslam::tracking {

struct HealthOptions {
  int dark_level = 16;                    // maximum grey value of a dark pixel
  int bright_level = 250;                 // minimum grey value of a bright pixel
  double black_pixel_ratio = 0.995;       // minimum fraction of dark pixels in a black image
  double over_exposed_pixel_ratio = 0.6;  // minimum fraction of bright pixels in an over-exposed image
  // Minimum fraction of the contrast of a sharp edge that lies between two adjacent pixels; a step that is blurred by a
  // Gaussian of standard deviation 1.5 px has 0.27.
  double sharp_slope = 0.28;
  double min_sharp_edge_ratio = 0.1;  // minimum fraction of sharp edges; an image with fewer is blurred
  int readmit_after = 3;  // consecutive good images until a camera is used again, if other cameras are available

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("dark_level", self.dark_level, Range{0, 255}, "",
            "maximum grey value of a dark pixel; an image of dark pixels is black", kCommon);
    visitor("bright_level", self.bright_level, Range{0, 255}, "",
            "minimum grey value of a bright pixel; an image of mostly bright pixels is over-exposed", kCommon);
    visitor("black_pixel_ratio", self.black_pixel_ratio, Range{0, 1}, "",
            "minimum fraction of dark pixels in a black image", OptionNote{.formerly = "dark_share"});
    visitor("over_exposed_pixel_ratio", self.over_exposed_pixel_ratio, Range{0, 1}, "",
            "minimum fraction of bright pixels in an over-exposed image", OptionNote{.formerly = "bright_share"});
    visitor("sharp_slope", self.sharp_slope, Range{0, 1}, "",
            "minimum fraction of the contrast of a sharp edge between two adjacent pixels");
    visitor("min_sharp_edge_ratio", self.min_sharp_edge_ratio, Range{0, 1}, "",
            "minimum fraction of sharp edges; an image with fewer is blurred", OptionNote{.formerly = "sharp_share"});
    visitor("readmit_after", self.readmit_after, Range{1, 1000}, "",
            "consecutive good images until a camera is used again");
  }
};

// Properties of an image from which the health of its camera is determined.
struct ImageHealth {
  CameraReason reason = CameraReason::kNone;  // black or over-exposed
  bool shows_something = true;                // some pixels are neither dark nor bright
  std::uint64_t content = 0;                  // hash of all pixels
  std::optional<bool> blurred;                // nullopt: there are too few edges
  BlockMeans blocks = {};
};

// Faults found in the images of a frame; one entry per camera.
struct ImageFaults {
  std::vector<CameraReason> outage;   // reason why the camera is not used in this frame; kNone: it is used
  std::vector<std::uint8_t> blurred;  // out of focus or smeared, but used
  std::vector<std::uint8_t> failing;  // not used; false if only an image is missing, as between images of a slow camera
  bool repeated = false;  // every image that is used is identical to the previous one of its camera, and there is one
};

class CameraMonitor {
 public:
  CameraMonitor(std::size_t cameras, const HealthOptions& options);

  // Checks the images of the next frame. `images`: one per camera; exposure and blur are those of the pixels that
  // neither the mask of an image nor that of its camera ignores. `masks`: one per camera, empty without a mask, or no
  // masks at all. The threads of `pool` share the images.
  ImageFaults examine(const image::ImageBundle& images, std::span<const image::Image> masks, ThreadPool& pool);

 private:
  using Health = std::vector<std::optional<ImageHealth>>;  // per camera; nullopt: it has no image

  // Per camera, why it is not used in this frame. An image is frozen if it is identical to the previous image of its
  // camera while the image of another camera has changed, or a still picture (still_views.h). If all images are
  // identical, the rig may be at rest: see ImageFaults::repeated and Tracker::note_repetition. After a few identical
  // images, as of a driver that repeats the images of a slow camera, the next one is used at once. A camera without an
  // image is not used in that frame, and used again with its next image. If all other cameras are out as well, a camera
  // with a good image is used immediately. If no image is good, the cameras whose images are only partly over-exposed
  // are used.
  std::vector<CameraReason> find_outages(const Health& images, TimeNs time_ns, bool& repeated);
  void admit_if_none_is_left(const Health& images, std::vector<CameraReason>& found);
  // Per camera: whether it is out of focus or smeared, determined from the slope of the edges in its image. Rows and
  // columns are searched, so that motion blur in one direction is not detected as blur. A blurred camera is still
  // used. Images with few edges do not change the result; a camera is blurred until `readmit_after` consecutive images
  // are sharp.
  std::vector<std::uint8_t> find_blurred(const Health& images);

  struct Camera {
    std::optional<std::uint64_t> last;          // hash of its last image
    CameraReason outage = CameraReason::kNone;  // reason of its last outage, until it is used again
    int good = 0;                               // consecutive good images since
    int repeated = 0;                           // images that were identical to the one before, since then
    bool blurred = false;
    int sharp = 0;                        // consecutive sharp images
    int missed = 0;                       // frames since its last image
    std::optional<TimeNs> last_image_ns;  // time of its last image, or of the first frame
  };
  // Per camera, whether it shows a still picture. Black and over-exposed images are not compared.
  std::vector<std::uint8_t> find_still(const Health& images, TimeNs time_ns);

  const HealthOptions options_;
  std::vector<Camera> cameras_;
  StillViews still_views_;
};

}  // namespace bslam::tracking
