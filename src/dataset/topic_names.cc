#include "dataset/topic_names.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace bslam::dataset {

std::string without_transport(std::string topic) {
  constexpr std::string_view kTransport = "/compressed";
  if (topic.ends_with(kTransport)) topic.resize(topic.size() - kTransport.size());
  return topic;
}

std::string plain_topic(std::string topic) {
  topic = without_transport(std::move(topic));
  return topic.starts_with('/') ? topic.substr(1) : topic;
}

std::string namespace_of(std::string topic) {
  topic = without_transport(std::move(topic));
  const std::size_t slash = topic.rfind('/');
  return slash == std::string::npos ? "" : topic.substr(0, slash);
}

std::string camera_name(const std::string& topic) {
  std::string name = namespace_of(topic);
  if (name.empty()) name = topic;
  name.erase(0, name.find_first_not_of('/') == std::string::npos ? name.size() : name.find_first_not_of('/'));
  std::ranges::replace(name, '/', '_');
  return name.empty() ? "camera" : name;
}

bool is_rectified(const std::string& topic) {
  const std::string last = topic.substr(namespace_of(topic).size());
  return last.starts_with("/image_rect") && !last.starts_with("/image_rect_raw");
}

}  // namespace bslam::dataset
