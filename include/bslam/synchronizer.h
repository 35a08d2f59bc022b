// Puts single images of live cameras together to bundles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/image_bundle.h"
#include "bslam/result.h"
#include "bslam/rig.h"

namespace bslam {

// Why an image is in no bundle.
enum class DropReason {
  kDuplicate,  // the camera has delivered an image with this time before
  kTooLate,    // the bundle it belongs to, or a later one, was handed out already
  kNoFrame,    // not within the tolerance of an image of camera 0, or another one of its camera is nearer to that
  kFarAhead,   // stamped far ahead of all images before it, as a broken clock does
  kOverflow    // its bundle was not fetched in time
};
inline constexpr std::size_t kDropReasons = 5;
BSLAM_EXPORT std::string_view to_string(DropReason reason);  // "duplicate", "too-late", ...

struct DroppedImage {
  std::size_t camera = 0;
  std::int64_t time_ns = 0;  // as it was pushed
  DropReason reason = DropReason::kTooLate;
};

struct SyncOptions {
  double tolerance_s = 0.002;   // images of different cameras this near make one bundle; below half a camera's interval
  double max_wait_s = 0.1;      // how much later, by the stamps of other images, a missing image may still come
  double reorder_s = 0;         // by how much the images of one camera may overtake each other
  double silent_after_s = 1;    // a camera without an image for so long is not waited for until it delivers again
  double max_ahead_s = 10;      // an image farther ahead of all others is dropped, unless its camera stays there
  std::size_t max_images = 32;  // that wait, per camera: with more the oldest bundle is handed out as it is
  std::size_t max_bundles = 4;  // that wait to be fetched: with more the oldest is dropped
  // Called by the thread that pushes or closes; may be empty. What it throws is returned by the call as an error, after
  // all other images were told.
  std::function<void(const DroppedImage&)> on_drop = {};
};

// What became of the images so far.
struct SyncCounts {
  std::size_t bundles = 0;                                     // handed out or ready
  std::vector<std::size_t> pushed;                             // per camera
  std::vector<std::array<std::size_t, kDropReasons>> dropped;  // per camera, by DropReason
  std::size_t waiting = 0;                                     // images of all cameras that are in no bundle yet
};

// The rule is that of recorded data sets: bundles are the instants of camera 0, the nearest image of every other camera
// within the tolerance belongs to it, and where camera 0 is silent the others make bundles of their own. A bundle is
// handed out once no missing image can be expected for it: each camera has delivered a later image, is not due yet by
// its own rate, is silent, or max_wait_s has passed. Time is that of the stamps, never of a clock, so the same sequence
// of pushes gives the same bundles, as long as they are fetched in time.
//
// All functions may be called from any thread. Bundles come in order of time.
class BSLAM_EXPORT Synchronizer {
 public:
  // Stamps are compared after the rig's time offsets were added. Errors: options that are negative or not finite, or
  // bounds of 0.
  static Result<Synchronizer> create(const Rig& rig, SyncOptions options = {});
  Synchronizer(Synchronizer&& other) noexcept;
  Synchronizer& operator=(Synchronizer&& other) noexcept;
  ~Synchronizer();

  // An image of one camera. With an `owner` it is shared, else its pixels are copied. Errors: no such camera, no data,
  // another size than the calibration's, a stride below the width, a time beyond +-4e18 ns, a call after close(); those
  // of on_drop, after which the image is taken all the same.
  Status push(std::size_t camera, const CameraImage& image);

  // The next bundle that is ready, if any.
  std::optional<ImageBundle> pop();

  // Waits for it. Empty once the synchroniser was closed and all bundles were fetched.
  std::optional<ImageBundle> wait();

  // No images follow: what waits becomes bundles, without limit of their number. Errors: those of on_drop alone, after
  // which it is closed all the same.
  Status close();

  SyncCounts counts() const;

 private:
  struct Impl;
  explicit Synchronizer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace bslam
