// Images given as arrays.
#pragma once

#include <bslam/image_bundle.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <vector>

namespace bslam::python {

// Images whose pixels belong to arrays, which are kept alive.
struct BorrowedImages {
  ImageBundle bundle;
  std::vector<nanobind::ndarray<nanobind::ro>> arrays;
};

// Reads the arguments of System.process without a copy of the pixels. `stamps` is an integer or one integer for each
// image, in nanoseconds; `images` are arrays or None, and so are `masks`, which may be None altogether. Throws Failure:
// another type or shape, pixels of a row that are not adjacent, another number of stamps or masks than of images, a
// mask of another size than its image.
BorrowedImages read_images(nanobind::handle stamps, nanobind::sequence images, nanobind::handle masks);

}  // namespace bslam::python
