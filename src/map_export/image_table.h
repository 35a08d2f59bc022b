// The images of the selected keyframes, with their names and files in the recording.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "dataset/dataset.h"
#include "map_export/selection.h"

namespace bslam::map_export {

struct MapImage {
  KeyframeId keyframe;
  std::size_t camera = 0;
  std::string name;  // relative to the folder of the recording: front/1000.jpg; without control characters
  std::optional<image_files::ImageFile> recorded;  // absent if it is not known
  image_decoding::PixelFormat format = {};
};

class ImageTable {
 public:
  // Lists the present images of all cameras, in order of keyframe and camera. `data` is the recording of the map, or
  // null: images that are not files of it are named CAMERA/STAMP.png, with the time stamp in ns. CAMERA is the name of
  // the camera with "_" for slashes and control characters, and unlike those of the other cameras. If recordings have
  // the same time stamps, several of the map or another one, images belong to the keyframes whose keypoints they show,
  // and names that would occur twice end in _2 and so on. After a stop, the images that were not read yet may be wrong.
  ImageTable(const Selection& selection, const dataset::Dataset* data, const std::filesystem::path& root,
             const std::stop_token& stop = {});

  const std::vector<MapImage>& images() const { return images_; }
  // Number of the image of a camera of a keyframe; -1 if it is missing.
  int of(KeyframeId k, std::size_t camera) const { return number_[k.index() * cameras_ + camera]; }
  std::size_t found() const { return found_; }  // number of images that are in the recording
  // Removes the images whose entry, one for each image, is zero.
  void keep(const std::vector<std::uint8_t>& kept);
  // Makes all names those of files in a new folder, with the extension, such as ".png": "_" replaces what leads out of
  // the folder.
  void set_extensions(const std::string& extension);

 private:
  std::size_t cameras_ = 0, found_ = 0;
  std::vector<MapImage> images_;
  std::vector<int> number_;  // per keyframe slot and camera
};

}  // namespace bslam::map_export
