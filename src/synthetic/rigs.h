// Camera rigs for simulation. Body frame: x forward, y left, z up; camera frame: x right, y down, z forward.
#pragma once

#include "camera/rig.h"

namespace bslam::synthetic {

// Four pinhole-radtan cameras of 752 x 480 pixels: two overlapping ones in front (baseline 0.11 m), one to the left,
// one to the right. Intrinsics, distortion and extrinsics vary slightly between cameras, as in calibrated rigs.
camera::Rig default_rig();

// `n` (1 to 8) pinhole-radtan cameras of `width` x 480/752 `width` pixels around the body: the first two in front with
// a baseline of 0.11 m, the others evenly distributed over the remaining directions.
camera::Rig ring_rig(int n, int width = 752);

// `n` (1 to 8) Kannala-Brandt fisheye cameras with a field of view of 190 degrees and `width` x `width` pixels, evenly
// distributed around the body.
camera::Rig fisheye_rig(int n, int width = 640);

// Two pinhole cameras in front and a fisheye on each side.
camera::Rig mixed_rig();

}  // namespace bslam::synthetic
