// Messages of cameras in every serialisation, and the images and calibrations in them.
#include "dataset/camera_info.h"
#include "image_decoding/image_file.h"
#include "recording_seeds.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> out;
  for (const auto wire :
       {support::Wire::kRos1, support::Wire::kCdr, support::Wire::kCdrBigEndian, support::Wire::kProtobuf}) {
    for (const support::TestMessage& message : small_recording(wire)) out.push_back(message.bytes);
  }
  return out;
}

namespace {

void check(const containers::Topic& topic, std::string_view bytes) {
  const auto info = containers::parse_camera_info(topic, bytes);
  if (info) {
    static_cast<void>(dataset::camera_of(*info, "camera", "/info"));
    static_cast<void>(dataset::stereo_extrinsics(*info, *info));
  }
  const auto image = containers::parse_image(topic, bytes);
  if (!image || image->data_at > bytes.size() || image->data_size > bytes.size() - image->data_at) return;
  for (const auto layout : {image_files::PixelLayout::kGrey, image_files::PixelLayout::kBgr,
                            image_files::PixelLayout::kUyvy, image_files::PixelLayout::kRggb}) {
    for (const int bytes_per_value : {1, 2}) {
      const image_files::StoredImage stored{.bytes = std::string(bytes),
                                            .begin = static_cast<std::size_t>(image->data_at),
                                            .size = static_cast<std::size_t>(image->data_size),
                                            .layout = layout,
                                            .width = static_cast<int>(image->width),
                                            .height = static_cast<int>(image->height),
                                            .step = image->step,
                                            .bytes_per_value = bytes_per_value,
                                            .big_endian = image->big_endian};
      const auto grey = image_decoding::decode_stored(stored);
      require(!grey || (grey->width() == stored.width && grey->height() == stored.height), "the size must be kept");
    }
  }
}

}  // namespace
}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const std::string_view bytes = fuzz::as_text(data, size);
  for (const auto serialisation : {containers::Serialisation::kRos1, containers::Serialisation::kCdr}) {
    for (const char* type : {"sensor_msgs/Image", "sensor_msgs/CompressedImage", "sensor_msgs/CameraInfo"})
      fuzz::check({"/a", type, "", serialisation}, bytes);
  }
  for (const char* type : {"foxglove/RawImage", "foxglove/CompressedImage", "foxglove/CameraCalibration"})
    fuzz::check({"/a", type, "", containers::Serialisation::kProtobuf}, bytes);
  return 0;
}
