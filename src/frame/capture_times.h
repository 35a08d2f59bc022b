// Cameras with different capture times.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "camera/rig.h"
#include "frame/bundled_frame.h"
#include "image/image_bundle.h"

namespace bslam::frame {

// Maximum difference of capture times that counts as simultaneous: at 1 rad/s and a focal length of
// 500 px the image moves by a pixel.
constexpr TimeNs kTogetherNs = 2'000'000;

// Returns true if the images of the two cameras can be compared: they were captured together, or the motion of the rig
// is known.
bool can_be_compared(const BundledFrame& frame, CameraIndex a, CameraIndex b);
// Returns true if both cameras have keypoints that cannot be compared.
bool captured_apart(const BundledFrame& frame, CameraIndex a, CameraIndex b);
// The camera that determines the time of the frame.
std::size_t reference_camera(const BundledFrame& frame);
// Time between the first and the last image of the frame.
double capture_span_s(const BundledFrame& frame);

// Flags the cameras to skip while the motion of the rig is unknown: those in `skipped`, and those whose image was not
// captured at the time of the frame. Returns `skipped` if otherwise no image would remain, or if no overlapping views
// would remain although there are some.
std::vector<std::uint8_t> without_late_cameras(const camera::Rig& rig, const image::ImageBundle& images,
                                               std::span<const std::uint8_t> skipped);

}  // namespace bslam::frame
