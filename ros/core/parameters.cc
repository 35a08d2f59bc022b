#include "core/parameters.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

namespace bslam_ros {
namespace {

constexpr std::string_view kCompressed = "/compressed";

bslam::Error wrong(const char* name, std::string found, std::string expected) {
  return {"parameter", name, std::move(found), std::move(expected)};
}

bslam::Status check_range(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return {};
  return wrong(name, std::to_string(value), std::to_string(least) + " to " + std::to_string(most));
}

}  // namespace

bslam::Status Parameters::check() const {
  if (image_topics.empty()) return wrong("image_topics", "no topic", "the image topic of each camera");
  for (std::size_t i = 0; i < image_topics.size(); ++i) {
    if (image_topics[i].empty()) return wrong("image_topics", "an empty name", "the image topic of each camera");
    for (std::size_t j = 0; j < i; ++j) {
      if (image_topics[i] == image_topics[j])
        return wrong("image_topics", image_topics[i] + " twice", "one camera each");
    }
  }
  const std::string cameras_text = std::to_string(image_topics.size()) + ", one for each image topic";
  for (const std::string& topic : image_topics) {
    if (rig.empty() && is_rectified(topic))
      return wrong("image_topics", topic + ", whose images are rectified, without a rig file",
                   "a topic of raw images, or the parameter rig with the calibration of the rectified images");
  }
  if (!camera_info_topics.empty() && camera_info_topics.size() != image_topics.size())
    return wrong("camera_info_topics", std::to_string(camera_info_topics.size()) + " topics", cameras_text);
  if (!cameras.empty() && cameras.size() != image_topics.size())
    return wrong("cameras", std::to_string(cameras.size()) + " cameras", cameras_text);
  if (map_frame == odom_frame || odom_frame == base_frame || map_frame == base_frame)
    return wrong("map_frame, odom_frame, base_frame", "'" + map_frame + "', '" + odom_frame + "', '" + base_frame + "'",
                 "three different frames");
  if (map_frame.empty() || map_frame.find_first_of(" \t\r\n") != std::string::npos)
    return wrong("map_frame", "'" + map_frame + "'", "the name of a frame, without spaces");
  for (const std::string& setting : settings) {
    if (setting.find('=') == std::string::npos) return wrong("settings", "'" + setting + "'", "name=value");
  }
  const struct {
    const char* name;
    double value, least, most;
  } ranges[] = {{"sync_tolerance", sync_tolerance, 0, 10},
                {"max_wait", max_wait, 0, 60},
                {"max_bundles", static_cast<double>(max_bundles), 1, 10000},
                {"queue_size", static_cast<double>(queue_size), 1, 10000},
                {"significant_bits", static_cast<double>(significant_bits), 8, 16},
                {"cloud_period", cloud_period, 0, 1e6},
                {"cloud_min_observations", static_cast<double>(cloud_min_observations), 1, 1e6},
                {"path_period", path_period, 0, 1e6},
                {"path_max_poses", static_cast<double>(path_max_poses), 2, 1e6},
                {"history_frames", static_cast<double>(history_frames), 0, 1e9}};
  for (const auto& range : ranges) {
    if (const bslam::Status status = check_range(range.name, range.value, range.least, range.most); !status)
      return status;
  }
  return {};
}

bslam::Result<bslam::Config> Parameters::make_config() const {
  bslam::Config out;
  if (!config.empty()) {
    if (const bslam::Status status = out.load(config); !status) return status.error();
  }
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    const bslam::Status status = out.set(setting.substr(0, equals), setting.substr(equals + 1));
    if (!status) return status.error();
  }
  return out;
}

bslam::Result<bslam::Rig> Parameters::load_rig() const {
  auto all = bslam::Rig::load(rig);
  if (!all) return all.error();
  auto used = cameras.empty() ? all : all->subset(cameras);
  if (!used) return used.error();
  if (used->size() != image_topics.size())
    return bslam::Error{rig, "", std::to_string(used->size()) + " cameras",
                        std::to_string(image_topics.size()) + ", one for each image topic; see the parameter cameras"};
  return used;
}

std::string Parameters::camera_info_topic(std::size_t i) const {
  if (!camera_info_topics.empty()) return camera_info_topics[i];
  std::string topic = image_topics[i];
  if (is_compressed(topic)) topic.resize(topic.size() - kCompressed.size());
  const std::size_t slash = topic.rfind('/');
  return (slash == std::string::npos ? std::string() : topic.substr(0, slash + 1)) + "camera_info";
}

std::vector<std::string> camera_names(const Parameters& parameters) {
  std::vector<std::string> out, numbered;
  std::set<std::string> different;
  for (std::string topic : parameters.image_topics) {
    if (is_compressed(topic)) topic.resize(topic.size() - kCompressed.size());
    topic.resize(std::max<std::size_t>(topic.rfind('/') + 1, 1) - 1);  // its folder; none: empty
    out.push_back(topic.substr(topic.rfind('/') + 1));
    numbered.push_back("cam" + std::to_string(numbered.size()));
    different.insert(out.back());
  }
  return different.size() == out.size() && different.count("") == 0 ? out : numbered;
}

std::string optical_axes_warning(const Parameters& parameters) {
  return "the body frame of " + parameters.rig + " has the axes of camera 0, z forward, and would be " +
         parameters.base_frame + ": set the parameter body_frame to the optical frame of camera 0, which tf must know";
}

bool subscribe_reliably(const std::vector<bool>& publishers) {
  return !publishers.empty() && std::find(publishers.begin(), publishers.end(), false) == publishers.end();
}

std::string earlier_trajectory_file(const std::string& trajectory_file, std::size_t n) {
  const std::filesystem::path path(trajectory_file);
  const std::string name = path.stem().string() + "_" + std::to_string(n) + path.extension().string();
  return (path.parent_path() / name).string();
}

bool is_rectified(const std::string& topic) {
  const std::string raw = is_compressed(topic) ? topic.substr(0, topic.size() - kCompressed.size()) : topic;
  const std::string name = raw.substr(raw.rfind('/') + 1);  // without a slash: the topic
  const auto begins = [&](std::string_view with) { return name.compare(0, with.size(), with) == 0; };
  return begins("image_rect") && !begins("image_rect_raw");
}

bool is_compressed(const std::string& topic) {
  return topic.size() > kCompressed.size() &&
         topic.compare(topic.size() - kCompressed.size(), kCompressed.size(), kCompressed) == 0;
}

}  // namespace bslam_ros
