// Groups single images of live cameras into bundles.
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

// The reason for which an image is in no bundle.
enum class DropReason {
  kDuplicate,  // the camera has already delivered an image with this time
  kTooLate,    // its bundle or a later one is already complete, or the time of its bundle would not increase
  kFarAhead,   // its time stamp is ahead of those of the other cameras, as with a broken clock
  kOverflow    // its bundle was not fetched in time
};
inline constexpr std::size_t kDropReasons = 4;
BSLAM_EXPORT std::string_view to_string(DropReason reason);  // "duplicate", "too-late", ...

struct DroppedImage {
  std::size_t camera = 0;
  std::int64_t time_ns = 0;  // time stamp as passed to push()
  DropReason reason = DropReason::kTooLate;
};

struct SyncOptions {
  // Maximum time difference within a bundle; must be less than half an image interval. For cameras with a constant
  // delay relative to camera 0, at least a tenth of the interval of camera 0 is used.
  double tolerance_s = 0.002;
  // How long a bundle waits for a missing image, in time stamps of other images. It is checked when an image arrives,
  // so the delay may be one image interval longer, and a bundle waits as long as no camera delivers.
  double max_wait_s = 0.1;
  // Maximum time difference between images of one camera that arrive out of order; if it is larger, they may be too
  // late. Bundles wait so much longer for such images, but not longer than max_wait_s.
  double reorder_s = 0;
  // A camera without an image for this long, and for four of its image intervals, is ignored until it delivers again.
  double silent_after_s = 1;
  // If the clock of a camera steps ahead by more than max_wait_s and the other cameras go on as before, its images are
  // dropped until its clock returns or the others have been silent for silent_after_s. If the clocks of all cameras
  // step, or there are no others, the step is accepted, but if it is longer than this time and than four intervals of
  // the camera, only at its third image; the first two are dropped. The first image is not trusted either: if it is
  // ahead by more than this time of the next two, which agree with each other, it is dropped. Only that of a single
  // camera waits for nothing, and if it is ahead, all images before its time are too late. Other clocks that go back
  // are not followed: create a new Synchronizer then, and a new System.
  double max_ahead_s = 1;
  // Maximum number of waiting images per camera; if it is exceeded, the oldest bundle is completed without its missing
  // images.
  std::size_t max_images = 32;
  // Maximum number of bundles that wait to be fetched; if it is exceeded, the oldest one is dropped. If more than
  // that are completed before another thread fetches any, the oldest are lost although push() succeeded: see on_drop
  // and counts().
  std::size_t max_bundles = 4;
  // Called by the thread that calls push() or close(); optional. An exception that it throws is returned by the call as
  // an error, after all other images were reported.
  std::function<void(const DroppedImage&)> on_drop = {};
};

// Numbers of images and bundles so far.
struct SyncCounts {
  std::size_t bundles = 0;                                     // fetched, or ready to be fetched
  std::vector<std::size_t> pushed;                             // images per camera
  std::vector<std::array<std::size_t, kDropReasons>> dropped;  // images per camera, by DropReason
  std::size_t waiting = 0;                                     // images of all cameras that are in no bundle yet
};

// Images are grouped by the same rule as recorded data sets, and every image belongs to exactly one bundle. Each image
// of camera 0 defines a bundle, to which the nearest image of every other camera within the tolerance belongs. The
// remaining images form bundles among themselves: the earliest defines one, to which the images of other cameras within
// the tolerance after it belong. A camera with a constant delay relative to camera 0 (to within a tenth of the interval
// of camera 0) is grouped as if it captured together with camera 0, even if the delay is half an interval, as for two
// cameras that are triggered alternately. The tolerance is then at least that tenth. Live, the delay is known after
// about five images of each camera, and again after it has changed, and follows a slow drift, as of cameras without a
// common trigger; in a recording it is known from the first image on.
//
// A bundle is ready when no missing image can be expected for it: each camera has delivered a later image, is not due
// yet according to its rate, is silent, or max_wait_s has passed. All times are time stamps of images, never of the
// system clock, so the same sequence of pushes gives the same bundles, as long as they are fetched in time.
//
// All functions may be called from any thread. Bundles come in order of time.
class BSLAM_EXPORT Synchronizer {
 public:
  // Time stamps are compared after adding the time offsets of the rig. Errors: options that are negative or not finite;
  // maximum numbers of 0.
  static Result<Synchronizer> create(const Rig& rig, SyncOptions options = {});
  Synchronizer(Synchronizer&& other) noexcept;
  Synchronizer& operator=(Synchronizer&& other) noexcept;
  // Ends calls of wait() and wait_for(), which return nullopt, and returns after them. No other call may be in progress
  // or follow: close it and join the threads that use it first.
  ~Synchronizer();

  // Adds an image of one camera. Its pixels are shared if it has an `owner`, otherwise copied. Success does not mean
  // that the image will be in a bundle, see DropReason. Errors: a camera index out of range, no data, a size that
  // differs from the calibration, a stride smaller than the width, a time beyond +-4e18 ns, a call after close(); an
  // exception of on_drop, in which case the image is accepted nevertheless.
  Status push(std::size_t camera, const CameraImage& image);

  // Returns the next bundle if one is ready.
  std::optional<ImageBundle> pop();

  // Waits for the next bundle. Returns nullopt when the synchroniser is closed and all bundles were fetched.
  std::optional<ImageBundle> wait();

  // The same, but also returns nullopt after this time in seconds without a bundle, as when all cameras have stopped.
  std::optional<ImageBundle> wait_for(double timeout_s);

  // Declares that no images follow: all waiting images become bundles, whose number is not limited. Errors: only an
  // exception of on_drop, in which case the synchroniser is closed nevertheless.
  Status close();

  SyncCounts counts() const;

 private:
  struct Impl;
  explicit Synchronizer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace bslam
