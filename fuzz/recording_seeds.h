// Small bags as seeds, and what must hold for every message file that can be opened.
#pragma once

#include <string>
#include <vector>

#include "containers/message_file.h"
#include "containers/messages.h"
#include "dataset/recording_description.h"
#include "support/bag_writer.h"
#include "target.h"

namespace bslam::fuzz {

// Two images and a calibration.
inline std::vector<support::TestMessage> small_recording(support::Wire wire) {
  const bool foxglove = wire == support::Wire::kProtobuf;
  const support::TestImage image{1'000'000'007, 4, 3, 4, "mono8", std::string(12, 'p')};
  const support::TestCalibration info{4,
                                      3,
                                      "plumb_bob",
                                      {0, 0, 0, 0, 0},
                                      {4, 0, 2, 0, 4, 1, 0, 0, 1},
                                      {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                      {4, 0, 2, 0, 0, 4, 1, 0, 0, 0, 1, 0}};
  return {{"/a/camera_info", foxglove ? "foxglove.CameraCalibration" : "sensor_msgs/CameraInfo", 1'000'000'000,
           support::calibration_message(wire, info)},
          {"/a/image", foxglove ? "foxglove.RawImage" : "sensor_msgs/Image", 1'000'000'010,
           support::image_message(wire, image)},
          {"/b/image/compressed", foxglove ? "foxglove.CompressedImage" : "sensor_msgs/CompressedImage", 1'000'000'020,
           support::compressed_image_message(wire, {1'000'000'009, 0, 0, 0, "png", "no image"})},
          {"/imu", "sensor_msgs/Imu", 1'000'000'030, "imu"}};
}

// Opens a file, reads all of its messages and describes it as a recording.
inline void check_message_file(const std::filesystem::path& path, std::size_t size) {
  const auto file = containers::open_message_file(path);
  if (file) {
    require((*file)->messages().size() <= size, "there are at most as many messages as bytes");
    std::size_t left = 300;  // damaged indices may name one message many times
    for (const containers::MessageRef& message : (*file)->messages()) {
      require(message.topic < (*file)->topics().size(), "a message must be of a topic");
      if (left-- == 0) break;
      const auto bytes = (*file)->read(message, containers::kWholeMessage);
      const auto start = (*file)->read(message, 16);
      require(!bytes || start, "the beginning of a message must be readable if the message is");
      if (!bytes) continue;
      const containers::Topic& topic = (*file)->topics()[message.topic];
      static_cast<void>(containers::parse_image(topic, *bytes));
      static_cast<void>(containers::parse_camera_info(topic, *bytes));
    }
  }
  static_cast<void>(dataset::describe_recording({.path = path}));
}

}  // namespace bslam::fuzz
