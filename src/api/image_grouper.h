// The single-threaded core of the synchroniser: groups images into bundles by their time stamps only. A camera that
// always captures at the same time between two images of camera 0 is grouped as if it captured together with it, as
// soon as its images have shown that (image/capture_phase.h): "in phase with camera 0".
#pragma once

#include <bslam/synchronizer.h>

#include <optional>
#include <vector>

#include "api/clock_watch.h"
#include "base/timestamp.h"
#include "image/capture_phase.h"
#include "image/frame_grouping.h"

namespace bslam::api {

class ImageGrouper {
 public:
  ImageGrouper(std::size_t cameras, const SyncOptions& options);

  // Adds an image. `time_ns` is its time including the camera's time offset. Bundles that become complete are appended
  // to `bundles`, and discarded images to `dropped`.
  void push(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
            std::vector<DroppedImage>& dropped);
  // Completes the remaining bundles; no image may follow.
  void flush(std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped);

  std::size_t waiting() const;  // number of images that are in no bundle yet

 private:
  struct WaitingImage {
    TimeNs time_ns = 0;
    CameraImage image;
  };
  struct Camera {
    std::vector<WaitingImage> waiting;  // in order of time
    std::optional<TimeNs> last_ns;      // time of its last image in a bundle
  };

  bool accept(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
              std::vector<DroppedImage>& dropped);
  bool can_form_its_own_bundle(std::size_t camera, TimeNs time_ns) const;
  bool watch_clock(std::size_t camera, TimeNs time_ns, std::vector<DroppedImage>& dropped);
  void remove(const ClockWatch::Refuted& refuted, std::vector<DroppedImage>& dropped);
  void update_phases();
  TimeNs in_phase(std::size_t camera, TimeNs time_ns) const { return time_ns - phases_.cameras[camera].later_ns; }
  TimeNs complete_until(std::size_t camera) const;
  bool is_complete(const image::GroupedFrame& frame) const;
  bool exceeds_limit() const;
  void emit_complete(bool last, std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped);
  const image::GroupedFrame& earliest(const image::FrameGroups& groups) const;
  TimeNs bundle_time(const image::GroupedFrame& frame) const;
  void emit(const image::GroupedFrame& frame, std::vector<ImageBundle>& bundles);
  void drop(const image::GroupedFrame& frame, std::vector<DroppedImage>& dropped);
  CameraImage take(std::size_t camera, int position);
  bool belongs_to_last_group(std::size_t camera, TimeNs time_ns) const;
  image::FrameGroups grouped() const;

  const std::size_t max_images_;
  const TimeNs tolerance_, max_wait_, reorder_, silent_after_;
  std::vector<Camera> cameras_;
  std::vector<std::vector<TimeNs>> recent_;  // per camera: increasing times of its newest images, for rate and phase
  image::CapturePhases phases_;
  ClockWatch clocks_;
  std::optional<TimeNs> last_bundle_ns_;  // time of the last complete bundle in phase with camera 0
  std::optional<TimeNs> last_time_ns_;    // its bundle_time()
  // Per camera: time of its image in the last complete bundle with an image of camera 0; nullopt if none.
  std::vector<std::optional<TimeNs>> last_group_with_camera0_;
};

}  // namespace bslam::api
