// Images passed as numpy arrays.
#pragma once

#include <bslam/image_bundle.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <vector>

namespace bslam::python {

// Images that refer to the pixels of arrays, with references that keep these arrays alive.
struct BorrowedImages {
  ImageBundle bundle;
  std::vector<nanobind::ndarray<nanobind::ro>> arrays;
};

// Reads the arguments of System.process without a copy of the pixels. `stamps` is an integer or one integer for each
// image, in nanoseconds; `images` are arrays or None, and so are `masks`, which may be None altogether. Throws Failure
// for a wrong type or shape, rows whose pixels are not contiguous, a number of stamps or masks that differs from the
// number of images, or a mask whose size differs from that of its image.
BorrowedImages read_images(nanobind::handle stamps, nanobind::handle images, nanobind::handle masks);

}  // namespace bslam::python
