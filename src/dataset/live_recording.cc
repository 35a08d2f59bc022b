#include "dataset/live_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/split.h"
#include "rig_formats/bslam_rig.h"

namespace bslam::dataset {
namespace {

constexpr const char* kTopics = "topics";

}  // namespace

const camera::RigCamera* LiveRecording::camera_of(const std::string& topic) const {
  const auto found = std::ranges::find(topics, topic);
  const auto index = static_cast<std::size_t>(found - topics.begin());
  return found == topics.end() || index >= cameras.size() ? nullptr : &cameras[index];
}

std::map<std::string, std::string> live_metadata(const std::vector<std::string>& topics) {
  std::string joined;
  for (const std::string& topic : topics) joined += (joined.empty() ? "" : ",") + topic;
  return {{kTopics, joined}, {"frames", "images with the same log_time are one frame"}};
}

std::optional<LiveRecording> live_recording_of(const containers::MessageFile& file) {
  const auto values = file.metadata().find(kLiveMetadata);
  if (values == file.metadata().end() || !values->second.contains(kTopics)) return std::nullopt;
  LiveRecording out;
  out.topics = split(values->second.at(kTopics), ',');
  const auto rig = std::ranges::find(file.attachments(), kLiveRigFile, &containers::Attachment::name);
  if (rig == file.attachments().end()) return out;
  auto reading = rig_formats::read_bslam_rig(file.path() / kLiveRigFile, rig->bytes);
  if (!reading) {
    out.warnings.push_back(reading.error().message() + "; the rig in the recording is not used");
  } else if (reading->cameras.size() == out.topics.size()) {
    out.cameras = std::move(reading->cameras);
  } else {
    out.warnings.push_back(fmt::format("{}: a rig of {} cameras for {} topics, which is not used", file.path().string(),
                                       reading->cameras.size(), out.topics.size()));
  }
  return out;
}

}  // namespace bslam::dataset
