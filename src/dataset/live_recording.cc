#include "dataset/live_recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "base/split.h"
#include "rig_formats/bslam_rig.h"

namespace bslam::dataset {
namespace {

constexpr int kMaxNumber = 1000;
constexpr const char *kTopics = "topics", *kCameras = "cameras";

// The numbers in a list such as "0,2"; empty unless it contains exactly `count` distinct numbers from 0 to kMaxNumber.
std::vector<int> parse_numbers(const std::string& text, std::size_t count) {
  std::vector<int> out;
  for (const std::string& part : split(text, ',')) {
    int number = -1;
    const auto [rest, error] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (error != std::errc() || rest != part.data() + part.size() || number < 0 || number > kMaxNumber) return {};
    if (std::ranges::find(out, number) != out.end()) return {};
    out.push_back(number);
  }
  return out.size() == count ? out : std::vector<int>();
}

}  // namespace

const camera::RigCamera* LiveRecording::camera_of(const std::string& topic) const {
  const auto found = std::ranges::find(topics, topic);
  const auto index = static_cast<std::size_t>(found - topics.begin());
  return found == topics.end() || index >= cameras.size() ? nullptr : &cameras[index];
}

geometry::SE3 LiveRecording::turn_of(const std::string& topic) const {
  return !topics.empty() && topic == topics.front() ? T_cam0_rig : geometry::SE3();
}

std::optional<int> LiveRecording::number_of(const std::string& topic) const {
  const auto index = static_cast<std::size_t>(std::ranges::find(topics, topic) - topics.begin());
  return index < numbers.size() ? std::optional(numbers[index]) : std::nullopt;
}

std::map<std::string, std::string> live_metadata(const std::vector<std::string>& topics,
                                                 const std::vector<int>& numbers) {
  return {{kTopics, fmt::format("{}", fmt::join(topics, ","))},
          {kCameras, fmt::format("{}", fmt::join(numbers, ","))},
          {"frames", "images with the same log_time are one frame"}};
}

std::string live_mask_file(std::size_t camera) { return fmt::format("masks/cam{}.png", camera); }

Status check_masks(const std::filesystem::path& path, const camera::Rig& rig) {
  const std::string inside = (std::filesystem::absolute(path) / "").lexically_normal().string();
  std::error_code error;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    if (camera.mask_file.empty() || camera.mask_file.starts_with(inside)) continue;
    if (std::filesystem::exists(camera.mask_file, error)) continue;
    return Error{path.string(), camera.name,
                 fmt::format("no file {}, the mask of the rig inside the recording", camera.mask_file),
                 "this file, or another calibration with --rig FILE, or masks with --masks DIR"};
  }
  return {};
}

std::optional<LiveRecording> live_recording_of(const containers::MessageFile& file) {
  const auto values = file.metadata().find(kLiveMetadata);
  if (values == file.metadata().end() || !values->second.contains(kTopics)) return std::nullopt;
  LiveRecording out;
  out.topics = split(values->second.at(kTopics), ',');
  if (const auto cameras = values->second.find(kCameras); cameras != values->second.end())
    out.numbers = parse_numbers(cameras->second, out.topics.size());
  const auto rig = std::ranges::find(file.attachments(), kLiveRigFile, &containers::Attachment::name);
  if (rig == file.attachments().end()) return out;
  auto reading = rig_formats::read_bslam_rig(file.path() / kLiveRigFile, rig->bytes);
  if (!reading) {
    out.warnings.push_back(reading.error().message() + "; the rig in the recording is not used");
  } else if (reading->cameras.size() == out.topics.size()) {
    out.cameras = std::move(reading->cameras);
    out.T_cam0_rig = reading->T_cam0_rig;
  } else {
    out.warnings.push_back(
        fmt::format("{}: the rig in the recording has {} cameras, but there are {} topics; the rig is not used",
                    file.path().string(), reading->cameras.size(), out.topics.size()));
  }
  return out;
}

}  // namespace bslam::dataset
