// What the warnings of the JPEG decoder mean.
#pragma once

#include <turbojpeg.h>

#include <string_view>

namespace bslam::image_decoding {

// Whether the image that the decoder has just decoded with a result other than 0 can be used. Cameras write files with
// small irregularities, of which the decoder only warns, such as bytes before a marker. If data are missing or
// wrong it warns as well, and fills the rest of the image with grey.
inline bool is_usable(tjhandle decoder) {
  if (tjGetErrorCode(decoder) != TJERR_WARNING) return false;
  const std::string_view warning = tjGetErrorStr2(decoder);
  const auto has = [warning](std::string_view text) { return warning.find(text) != std::string_view::npos; };
  return !has("Premature end") && (!has("Corrupt JPEG data") || has("extraneous bytes"));
}

}  // namespace bslam::image_decoding
