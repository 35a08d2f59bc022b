// Reads or plays the images of one camera of a data set in EuRoC layout.
#pragma once

#include <bslam/image_bundle.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>

// Returns the image files by time in nanoseconds, from DATA/mav0/camN/data.csv (lines "time,name" after a comment).
inline std::map<std::int64_t, std::string> list_images(const std::string& data, std::size_t camera) {
  const std::string folder = data + "/mav0/cam" + std::to_string(camera);
  std::map<std::int64_t, std::string> images;
  std::ifstream csv(folder + "/data.csv");
  for (std::string line; std::getline(csv, line);) {
    const auto comma = line.find(',');
    if (line.empty() || line[0] == '#' || comma == std::string::npos) continue;
    while (line.back() == '\r' || line.back() == ' ') line.pop_back();
    images[std::stoll(line)] = folder + "/data/" + line.substr(line.find_first_not_of(' ', comma + 1));
  }
  return images;
}

// Reads an image. A shared cv::Mat owns the pixels. `data` is null if the file cannot be read.
inline bslam::CameraImage read_image(const std::string& file, std::int64_t time_ns) {
  const auto mat = std::make_shared<cv::Mat>(cv::imread(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION));
  return {mat->data, mat->cols, mat->rows, static_cast<std::ptrdiff_t>(mat->step), time_ns, mat};
}

// Calls deliver(image) for each image that can be read, at `speed` times the recorded rate.
template <class Deliver>
void play_images(const std::string& data, std::size_t camera, double speed, const Deliver& deliver) {
  const auto files = list_images(data, camera);
  const auto start = std::chrono::steady_clock::now();
  for (const auto& [time_ns, file] : files) {
    const std::chrono::duration<double, std::nano> due(static_cast<double>(time_ns - files.begin()->first) / speed);
    std::this_thread::sleep_until(start + std::chrono::duration_cast<std::chrono::nanoseconds>(due));
    const bslam::CameraImage image = read_image(file, time_ns);
    if (image.data != nullptr) deliver(image);
  }
}
