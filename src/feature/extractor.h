// Oriented FAST and rotated BRIEF (Rublee et al., ICCV 2011): image -> detections of one camera.
#pragma once

#include <memory>
#include <optional>

#include "base/options.h"
#include "camera/camera.h"
#include "feature/feature_model.h"
#include "feature/keypoints.h"
#include "image/image.h"
#include "image/pyramid.h"

namespace bslam::feature {

struct FeatureOptions {
  static constexpr int kMaxFactorIfOthersFail = 2;
  int per_image =
      1200;  // keypoints wanted in one image at most; kMaxFactorIfOthersFail times as many where other cameras are out
  // Keypoints wanted in the images of all cameras together, 0: no bound. Three cameras just reach it: a third one takes
  // nothing from the first two. Four take some 1.35 times as long as two (1.8 times without bound).
  int per_rig = 3600;
  int levels = 8;              // pyramid levels
  double scale_factor = 1.2;   // ratio of one level to the next
  int fast_threshold = 20;     // grey levels: what counts as a corner in a well lit image
  int fast_threshold_min = 5;  // the least it adapts to in dark or blurred regions
  double sigma_px =
      0.4;  // standard deviation of a keypoint on its level before sub-pixel alignment (measured: 0.25 - 0.35)

  FeatureModel model() const { return {sigma_px, {scale_factor, levels}}; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("per_image", self.per_image, Range{50, 20000}, "",
            "keypoints wanted in one image at most; twice as many where other cameras are out", kCommon);
    visitor("per_rig", self.per_rig, Range{0, 100000}, "", "keypoints wanted in all cameras together; 0: no bound",
            kCommon);
    visitor("levels", self.levels, Range{1, 16}, "", "pyramid levels", kCommon);
    visitor("scale_factor", self.scale_factor, Range{1.05, 2.0}, "", "ratio of one level to the next", kCommon);
    visitor("fast_threshold", self.fast_threshold, Range{2, 200}, "grey levels", "corner threshold in a well lit image",
            kCommon);
    visitor("fast_threshold_min", self.fast_threshold_min, Range{1, 200}, "grey levels",
            "least corner threshold in dark or blurred regions", kCommon);
    visitor("sigma_px", self.sigma_px, Range{0.05, 5.0}, "px", "standard deviation of a keypoint on its level");
  }
};

// Extracts from one camera's images, one after the other; holds scratch memory only, so that a frame of the usual size
// allocates nothing. One extractor per camera: not to be shared between threads at a time.
class Extractor {
 public:
  explicit Extractor(const FeatureOptions& options);
  ~Extractor();
  Extractor(Extractor&&) noexcept;
  Extractor& operator=(Extractor&&) noexcept;

  // Fills `detections` (cleared first) with at most `budget` entries (no more than kMaxFactorIfOthersFail *
  // options.per_image; none given: options.per_image), spread evenly over the image, in an order that depends on image
  // and number alone, and `pyramid` with the levels they were found on. Keypoints whose pixel has no bearing in
  // `camera`, or where `mask` (same size as the image, or empty) is 0, are left out.
  void extract(const image::ImageView& image, const image::ImageView& mask, const camera::Camera& camera,
               image::Pyramid& pyramid, Detections& detections, std::optional<int> budget = {});

 private:
  struct Scratch;
  FeatureOptions options_;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace bslam::feature
