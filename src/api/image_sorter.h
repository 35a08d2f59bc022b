// The synchroniser without threads: images in, bundles out, decided by their times alone.
#pragma once

#include <bslam/synchronizer.h>

#include <optional>
#include <vector>

#include "base/timestamp.h"
#include "image/frame_grouping.h"

namespace bslam::api {

class ImageSorter {
 public:
  ImageSorter(std::size_t cameras, const SyncOptions& options);

  // `time_ns`: of the image, with its camera's time offset. What can be decided then is appended to `bundles` and
  // `dropped`.
  void push(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
            std::vector<DroppedImage>& dropped);
  // The rest; no image follows.
  void flush(std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped);

  std::size_t waiting() const;  // images

 private:
  struct Waiting {
    TimeNs time_ns = 0;
    CameraImage image;
  };
  struct Camera {
    std::vector<Waiting> waiting;  // in order of time
    std::vector<TimeNs> recent;    // times of its newest images, increasing: tell its rate
    int far_ahead = 0;             // images in a row that are far ahead of all others
  };

  bool accept(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<DroppedImage>& dropped);
  bool far_ahead(Camera& camera, TimeNs time_ns) const;
  void note_time(Camera& camera, TimeNs time_ns);
  TimeNs complete_until(std::size_t camera) const;
  TimeNs gap() const;
  bool decided(const image::GroupedFrame& frame) const;
  bool overfull() const;
  void decide(bool last, std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped);
  void hand_out(const image::GroupedFrame& frame, std::vector<ImageBundle>& bundles,
                std::vector<DroppedImage>& dropped);
  void drop_until(TimeNs time_ns, DropReason reason, std::vector<DroppedImage>& dropped);
  image::FrameGroups grouped() const;

  const std::size_t max_images_;
  const TimeNs tolerance_, max_wait_, reorder_, silent_after_, max_ahead_;
  std::vector<Camera> cameras_;
  std::optional<TimeNs> first_ns_, newest_ns_;  // of all images
  std::optional<TimeNs> handed_out_ns_;         // time of the bundle handed out last ...
  std::optional<TimeNs> anchor_ns_;             // ... and of the last one with an image of camera 0
};

}  // namespace bslam::api
