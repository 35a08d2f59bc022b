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
  // Maximum target number of keypoints per image; kMaxFactorIfOthersFail times as many if other cameras are out.
  int per_image = 1200;
  // Target number of keypoints of all cameras together, 0: unlimited. The default equals three times per_image. With it
  // the time per frame of four cameras is about 1.35 times that of two (1.8 times if unlimited).
  int per_rig = 3600;
  int levels = 8;              // pyramid levels
  double scale_factor = 1.2;   // scale factor between adjacent levels
  int fast_threshold = 20;     // grey levels, corner threshold in a well lit image
  int fast_threshold_min = 5;  // grey levels, minimum corner threshold in dark or blurred regions
  // Pixels of its level, standard deviation of a keypoint before sub-pixel alignment (measured: 0.25 - 0.35).
  double sigma_px = 0.4;

  FeatureModel model() const { return {sigma_px, {scale_factor, levels}}; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("per_image", self.per_image, Range{50, 20000}, "",
            "maximum target number of keypoints per image; twice as many if other cameras are out", kCommon);
    visitor("per_rig", self.per_rig, Range{0, 100000}, "",
            "target number of keypoints of all cameras together; 0: unlimited", kCommon);
    visitor("levels", self.levels, Range{1, 16}, "", "pyramid levels", kCommon);
    visitor("scale_factor", self.scale_factor, Range{1.05, 2.0}, "", "scale factor between adjacent levels", kCommon);
    visitor("fast_threshold", self.fast_threshold, Range{2, 200}, "grey levels", "corner threshold in a well lit image",
            kCommon);
    visitor("fast_threshold_min", self.fast_threshold_min, Range{1, 200}, "grey levels",
            "minimum corner threshold in dark or blurred regions", kCommon);
    visitor("sigma_px", self.sigma_px, Range{0.05, 5.0}, "px",
            "standard deviation of a keypoint before sub-pixel alignment, in pixels of its level");
  }
};

// Extracts the keypoints of one camera's images. Its only state is scratch memory, which is allocated with the first
// image. One extractor per camera; not thread-safe.
class Extractor {
 public:
  explicit Extractor(const FeatureOptions& options);
  ~Extractor();
  Extractor(Extractor&&) noexcept;
  Extractor& operator=(Extractor&&) noexcept;

  // Fills `detections` (cleared first) with at most `budget` keypoints distributed evenly over the image, and `pyramid`
  // with the levels of the image. The budget is bounded by kMaxFactorIfOthersFail * options.per_image; the default is
  // options.per_image. The result depends on the image, the mask and the budget only. Keypoints whose pixel has no
  // bearing in `camera`, or at which `mask` (same size as the image, or empty) is 0, are ignored.
  void extract(const image::ImageView& image, const image::ImageView& mask, const camera::Camera& camera,
               image::Pyramid& pyramid, Detections& detections, std::optional<int> budget = {});
  // The same from the pyramid of the image.
  void extract(const image::Pyramid& pyramid, const image::ImageView& mask, const camera::Camera& camera,
               Detections& detections, std::optional<int> budget = {});

 private:
  struct Scratch;
  FeatureOptions options_;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace bslam::feature
