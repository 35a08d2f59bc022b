#include "images.h"

#include <nanobind/stl/string.h>

#include <optional>
#include <string>
#include <utility>

#include "arguments.h"
#include "errors.h"

namespace bslam::python {
namespace {

namespace nb = nanobind;

constexpr const char* kProcess = "System.process";

using Pixels = nb::ndarray<nb::ro>;

std::string type_of(nb::handle object) { return nb::cast<std::string>(object.type().attr("__name__")); }

std::string element(const char* name, std::size_t i) { return std::string(name) + "[" + std::to_string(i) + "]"; }

std::int64_t integer(nb::handle object, const std::string& key) {
  nb::object index;
  if (PyIndex_Check(object.ptr())) index = nb::steal(PyNumber_Index(object.ptr()));
  const long long value = index ? PyLong_AsLongLong(index.ptr()) : 0;
  if (!index || PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    raise({kProcess, key, type_of(object) + " " + nb::cast<std::string>(nb::str(object)),
           "an integer number of nanoseconds"});
  }
  return value;
}

// Arrays of integers have the operation that converts to an index, but it fails unless they are scalars.
bool is_integer(nb::handle object) {
  if (!PyIndex_Check(object.ptr())) return false;
  if (PySequence_Check(object.ptr()) == 0) return true;
  const bool converts = nb::steal(PyNumber_Index(object.ptr())).is_valid();
  PyErr_Clear();
  return converts;
}

// Returns an array of type uint8 and shape (h, w) in which the pixels of a row are adjacent.
Pixels pixels_of(nb::handle object, const std::string& key) {
  Pixels array;
  if (!nb::try_cast(object, array, false))
    raise({kProcess, key, type_of(object), "a uint8 array of shape (h, w), or None"});
  const bool grey =
      array.ndim() == 2 && array.dtype() == nb::dtype<std::uint8_t>() && array.device_type() == nb::device::cpu::value;
  if (!grey) raise({kProcess, key, "an " + description_of(object), "a uint8 array of shape (h, w): 8-bit grey values"});
  if (array.shape(1) > 1 && array.stride(1) != 1) {
    raise({kProcess, key, std::to_string(array.stride(1)) + " bytes between the pixels of a row",
           "adjacent pixels, as made by numpy.ascontiguousarray"});
  }
  return array;
}

CameraImage image_of(const Pixels& array) {
  CameraImage image;
  image.data = static_cast<const std::uint8_t*>(array.data());
  image.height = static_cast<int>(array.shape(0));
  image.width = static_cast<int>(array.shape(1));
  image.stride = array.stride(0);
  return image;
}

void add_mask(CameraImage& image, const Pixels& mask, const std::string& key) {
  const auto size = [](auto height, auto width) {
    return "shape (" + std::to_string(height) + ", " + std::to_string(width) + ")";
  };
  const std::string found = size(mask.shape(0), mask.shape(1)), expected = size(image.height, image.width);
  if (found != expected) raise({kProcess, key, found, expected + ", that of the image"});
  image.mask = static_cast<const std::uint8_t*>(mask.data());
  image.mask_stride = mask.stride(0);
}

void check_length(nb::handle sequence, const char* key, std::size_t images, const char* expected) {
  if (!PySequence_Check(sequence.ptr())) raise({kProcess, key, type_of(sequence), expected});
  if (const std::size_t length = nb::len(sequence); length != images)
    raise({kProcess, key, std::to_string(length), std::to_string(images) + ", one for each image"});
}

}  // namespace

BorrowedImages read_images(nb::handle stamps, nb::handle images, nb::handle masks) {
  check_sequence(images, kProcess, "images", "a list of arrays, one per camera of the rig");
  BorrowedImages out;
  const std::size_t count = nb::len(images);
  std::optional<std::int64_t> common;
  if (is_integer(stamps)) common = integer(stamps, "stamps");
  if (!common) check_length(stamps, "stamps", count, "an integer number of nanoseconds, or a list of them");
  if (!masks.is_none()) check_length(masks, "masks", count, "a list of arrays");
  for (std::size_t i = 0; i < count; ++i) {
    CameraImage& image = out.bundle.images.emplace_back();
    const nb::object object(images[i]);
    if (object.is_none()) continue;
    out.arrays.push_back(pixels_of(object, element("images", i)));
    image = image_of(out.arrays.back());
    image.time_ns = common ? *common : integer(nb::object(stamps[i]), element("stamps", i));
    if (masks.is_none() || nb::object(masks[i]).is_none()) continue;
    out.arrays.push_back(pixels_of(nb::object(masks[i]), element("masks", i)));
    add_mask(image, out.arrays.back(), element("masks", i));
  }
  return out;
}

}  // namespace bslam::python
