#include "dataset/bag_recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/lower_case.h"
#include "containers/input_file.h"
#include "dataset/bag_images.h"
#include "dataset/camera_info.h"
#include "dataset/live_recording.h"
#include "dataset/recording_description.h"
#include "dataset/rosbag2_folder.h"
#include "dataset/topic_names.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

bool has_header_stamps(const ImageTopic& topic) {
  return std::ranges::any_of(topic.images, [](const BagImage& image) { return image.stamp_ns != 0; });
}

bool is_time(TimeNs time_ns) { return time_ns > 0 && time_ns <= kMaxTime; }

// The time stamps of all images, from their headers or, if those are not set, of recording; nullopt: not a time.
std::vector<std::optional<TimeNs>> stamps_of(const ImageTopic& topic) {
  const bool from_header = has_header_stamps(topic);
  std::vector<std::optional<TimeNs>> out;
  for (const BagImage& image : topic.images) {
    const TimeNs time_ns = from_header ? image.stamp_ns : image.received_ns;
    out.push_back(is_time(time_ns) ? std::optional(time_ns) : std::nullopt);
  }
  return out;
}

class BagRecording : public Recording {
 public:
  BagRecording(std::shared_ptr<BagStore> store, std::vector<std::string> warnings)
      : store_(std::move(store)), warnings_(std::move(warnings)) {
    for (const auto& file : store_->files())
      warnings_.insert(warnings_.end(), file->warnings().begin(), file->warnings().end());
    topics_ = store_->find_images();
    if (store_->files().size() == 1) live_ = live_recording_of(*store_->files().front());
    if (live_) warnings_.insert(warnings_.end(), live_->warnings.begin(), live_->warnings.end());
  }

  Status choose(const std::vector<std::string>& requested, const std::string& path);

  std::size_t camera_count() const override { return cameras_.size(); }
  bool calibrated() const override {
    return std::ranges::any_of(cameras_, [&](std::size_t c) { return is_calibrated(topics_[c].name); });
  }
  std::string calibration_origin() const override {
    return live_ && !live_->cameras.empty() ? "rig of bslam live in its recording" : "CameraInfo of a bag";
  }
  Result<camera::RigCamera> calibration(std::size_t camera) const override;
  geometry::SE3 turn_in_rig(std::size_t camera) const override {
    return live_ ? live_->turn_of(topics_[cameras_[camera]].name) : geometry::SE3();
  }
  Status check_calibration(const camera::Rig& rig) const override {
    return live_ ? check_masks(store_->files().front()->path(), rig) : Status();
  }
  int number_in_rig(std::size_t camera) const override {
    const auto number = live_ ? live_->number_of(topics_[cameras_[camera]].name) : std::nullopt;
    return number.value_or(static_cast<int>(camera));
  }
  std::vector<int> recorded_numbers() const override;
  Result<image_files::ImageList> images(std::size_t camera) const override;
  bool has_times() const override { return true; }
  std::vector<std::string> names_in_topics() const override;
  std::vector<std::string> topics() const override {
    std::vector<std::string> out;
    for (const std::size_t t : cameras_) out.push_back(topics_[t].name);
    return has_order() ? std::vector<std::string>() : out;
  }
  std::vector<std::string> warnings() const override { return warnings_; }
  RecordingDescription describe() const override;

 private:
  struct Calibration {
    containers::CameraInfo info;
    std::string source;
  };
  // The calibration in the namespace of an image topic.
  std::optional<Calibration> calibration_of(const std::string& topic) const;
  bool is_calibrated(const std::string& topic) const {
    return (live_ && live_->camera_of(topic) != nullptr) || calibration_of(topic).has_value();
  }
  // Returns true if the order of the topics was requested, or recorded with the rig.
  bool has_order() const {
    const auto is_listed = [&](std::size_t t) { return std::ranges::count(live_->topics, topics_[t].name) > 0; };
    return !proposed_ || (live_ && std::ranges::all_of(cameras_, is_listed));
  }
  Status choose_requested(const std::vector<std::string>& requested, const std::string& path);
  std::optional<geometry::SE3> body_from_cam(std::size_t camera) const;
  std::string name_of(std::size_t camera) const;
  StreamDescription describe(const ImageTopic& topic) const;
  std::string why_unused(const ImageTopic& topic) const;

  std::shared_ptr<BagStore> store_;
  std::vector<std::string> warnings_;
  std::vector<ImageTopic> topics_;    // in the natural order of their names
  std::vector<std::size_t> cameras_;  // the topics of the cameras
  std::optional<LiveRecording> live_;
  bool proposed_ = true;  // the topics were not requested
};

// Depth images of 16 bits can be read, but are no photographs.
bool is_depth(const ImageTopic& topic) {
  return lower_case(topic.name).find("depth") != std::string::npos && topic.encoding.starts_with("16UC1");
}

// A topic and its compressed copy are one camera.
std::string BagRecording::why_unused(const ImageTopic& topic) const {
  if (!topic.unusable.empty()) return topic.unusable;
  const auto is_photograph = [](const ImageTopic& t) { return t.unusable.empty() && !is_depth(t); };
  if (is_depth(topic) && std::ranges::any_of(topics_, is_photograph)) return "depth images; --topics can name it";
  const std::string plain = without_transport(topic.name);
  if (plain == topic.name) return "";
  const auto original = std::ranges::find(topics_, plain, &ImageTopic::name);
  return original != topics_.end() && original->unusable.empty() ? "the same images as " + plain : "";
}

Status BagRecording::choose(const std::vector<std::string>& requested, const std::string& path) {
  proposed_ = requested.empty();
  if (topics_.empty()) {
    std::set<std::string> types;
    for (const auto& file : store_->files()) {
      for (const containers::Topic& topic : file->topics()) types.insert(topic.type);
    }
    return Error{path, "", fmt::format("no image topic, but {}", fmt::join(types, ", ")),
                 "topics of sensor_msgs/Image, sensor_msgs/CompressedImage, foxglove.RawImage or "
                 "foxglove.CompressedImage"};
  }
  for (std::size_t t = 0; proposed_ && t < topics_.size(); ++t) {
    const std::string why = why_unused(topics_[t]);
    if (why.empty())
      cameras_.push_back(t);
    else
      warnings_.push_back(fmt::format("{}: {} is not used: {}", path, topics_[t].name, why));
  }
  if (live_ && proposed_) {  // in the order of the rig
    const auto place = [&](std::size_t t) { return std::ranges::find(live_->topics, topics_[t].name); };
    std::ranges::stable_sort(cameras_, {}, place);
  }
  if (const Status s = choose_requested(requested, path); !s) return s;
  if (cameras_.empty())
    return Error{path, topics_.front().name, topics_.front().unusable, "a topic with images that can be read"};
  return {};
}

Status BagRecording::choose_requested(const std::vector<std::string>& requested, const std::string& path) {
  std::vector<std::string> names;
  for (const ImageTopic& topic : topics_) names.push_back(topic.name);
  for (const std::string& name : requested) {
    const auto found = std::ranges::find(topics_, name, &ImageTopic::name);
    if (found == topics_.end())
      return Error{"--topics", "", name, fmt::format("image topics of {}: {}", path, fmt::join(names, ", "))};
    const auto index = static_cast<std::size_t>(found - topics_.begin());
    if (std::ranges::find(cameras_, index) != cameras_.end())
      return Error{"--topics", "", name + " twice", "each topic once"};
    if (!found->unusable.empty()) return Error{path, name, found->unusable, "images that can be read"};
    cameras_.push_back(index);
  }
  return {};
}

std::vector<std::string> BagRecording::names_in_topics() const {
  std::vector<std::string> names;
  for (const std::size_t t : cameras_) {
    const camera::RigCamera* recorded = proposed_ && live_ ? live_->camera_of(topics_[t].name) : nullptr;
    if (recorded) names.push_back(recorded->camera.name);
  }
  if (!names.empty()) return names.size() == cameras_.size() ? names : std::vector<std::string>();
  for (const std::string& topic : topics()) names.push_back(camera_name(topic));
  std::vector<std::string> out = names;
  for (std::string& name : out) {
    if (std::ranges::count(names, name) > 1) name.clear();
  }
  return out;
}

std::vector<int> BagRecording::recorded_numbers() const {
  std::vector<int> out;
  for (std::size_t c = 0; proposed_ && live_ && c < cameras_.size(); ++c) {
    const auto number = live_->number_of(topics_[cameras_[c]].name);
    if (!number) return {};
    out.push_back(*number);
  }
  return out;
}

// At most two cameras have a calibration here (body_from_cam), so that a number identifies them.
std::string BagRecording::name_of(std::size_t camera) const {
  const std::string name = camera_name(topics_[cameras_[camera]].name);
  for (std::size_t other = 0; other < cameras_.size(); ++other) {
    if (other != camera && camera_name(topics_[cameras_[other]].name) == name)
      return fmt::format("{}_{}", name, camera);
  }
  return name;
}

std::optional<BagRecording::Calibration> BagRecording::calibration_of(const std::string& topic) const {
  for (const auto& file : store_->files()) {
    for (const containers::MessageRef& message : file->messages()) {
      const containers::Topic& from = file->topics()[message.topic];
      if (!containers::is_calibration_type(from.type) || namespace_of(from.name) != namespace_of(topic)) continue;
      const auto bytes = file->read(message, containers::kWholeMessage);
      auto info = bytes ? containers::parse_camera_info(from, *bytes) : std::nullopt;
      if (!info) continue;
      if (is_rectified(topic) && info->P[0] > 0) {
        info->K = {info->P[0], info->P[1], info->P[2], info->P[4], info->P[5], info->P[6], 0, 0, 1};
        info->R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        info->distortion.clear();
        info->distortion_model.clear();
      }
      return Calibration{*std::move(info), fmt::format("{}: {}", file->path().string(), from.name)};
    }
  }
  return std::nullopt;
}

// The body is camera 0. Two cameras may be a stereo pair; nothing else has extrinsics in these messages.
std::optional<geometry::SE3> BagRecording::body_from_cam(std::size_t camera) const {
  if (camera == 0 && cameras_.size() == 1) return geometry::SE3();
  if (cameras_.size() != 2) return std::nullopt;
  const auto first = calibration_of(topics_[cameras_[0]].name), second = calibration_of(topics_[cameras_[1]].name);
  const auto found = first && second ? stereo_extrinsics(first->info, second->info) : std::nullopt;
  return found && camera == 0 ? geometry::SE3() : found;
}

Result<camera::RigCamera> BagRecording::calibration(std::size_t camera) const {
  const ImageTopic& topic = topics_[cameras_[camera]];
  if (const camera::RigCamera* recorded = live_ ? live_->camera_of(topic.name) : nullptr) return *recorded;
  const auto source = store_->source(topic.images.front().entry);
  const auto found = calibration_of(topic.name);
  if (!found) {
    return Error{source, "", "no CameraInfo beside it", "a rig file (--rig FILE)",
                 source + " has no camera_info beside it; specify the calibration with --rig FILE"};
  }
  auto out = camera_of(found->info, name_of(camera), found->source);
  if (!out) return out;
  if (topic.width > 0 && (topic.width != out->camera.width || topic.height != out->camera.height)) {
    return Error{
        found->source, "", fmt::format("a calibration for {}x{} pixels", out->camera.width, out->camera.height),
        fmt::format("{}x{}, the size of the images of {}; or --rig FILE", topic.width, topic.height, topic.name)};
  }
  const auto body = body_from_cam(camera);
  if (!body) {
    return Error{
        found->source, "", "no extrinsics", "a rig file (--rig FILE)",
        fmt::format("{}: CameraInfo tells where cameras are only of a stereo pair with a baseline in P; specify "
                    "the calibration of the {} cameras with --rig FILE, or use one with --topics",
                    found->source, cameras_.size())};
  }
  return camera::RigCamera{std::move(out->camera), *body};
}

Result<image_files::ImageList> BagRecording::images(std::size_t camera) const {
  const ImageTopic& topic = topics_[cameras_[camera]];
  const std::string source = store_->source(topic.images.front().entry);
  const std::vector<std::optional<TimeNs>> stamps = stamps_of(topic);
  std::vector<image_files::ImageFile> images;
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    if (!stamps[k]) continue;
    images.push_back({.path = {}, .time_ns = *stamps[k], .store = store_, .entry = topic.images[k].entry});
    if (live_) images.back().frame_ns = topic.images[k].received_ns;
  }
  const std::size_t without_stamp = stamps.size() - images.size();
  if (images.empty()) return Error{source, "", "no image with a time stamp", "images with time stamps"};
  image_files::ImageList list = image_files::in_time_order(std::move(images), source, image_files::StampUnit::kSeconds);
  if (!has_header_stamps(topic))
    list.warnings.push_back(source + ": the headers have no time stamps; the times of recording are used");
  if (without_stamp > 0)
    list.warnings.push_back(fmt::format("{}: {} images without a time stamp are not used", source, without_stamp));
  if (topic.unreadable > 0)
    list.warnings.push_back(fmt::format("{}: {} messages are damaged and are not used", source, topic.unreadable));
  return list;
}

// Differences between the time of recording and that of the header.
std::optional<LagDescription> lag_of(const ImageTopic& topic) {
  std::vector<TimeNs> lags;
  for (const BagImage& image : topic.images) {
    if (is_time(image.stamp_ns) && image.received_ns > 0) lags.push_back(image.received_ns - image.stamp_ns);
  }
  if (lags.empty()) return std::nullopt;
  std::ranges::sort(lags);
  return LagDescription{to_seconds(lags.front()), to_seconds(lags[lags.size() / 2]), to_seconds(lags.back())};
}

StreamDescription BagRecording::describe(const ImageTopic& topic) const {
  StreamDescription out;
  out.name = topic.name;
  out.type = topic.type;
  out.encoding = topic.encoding;
  out.width = topic.width;
  out.height = topic.height;
  out.count = topic.images.size() + topic.unreadable;
  const bool from_header = has_header_stamps(topic);
  for (const std::optional<TimeNs>& stamp : stamps_of(topic)) {
    if (stamp) out.times.push_back(*stamp);
  }
  std::ranges::sort(out.times);
  out.stamps = from_header ? "header" : "recording";
  out.lag = from_header ? lag_of(topic) : std::nullopt;
  out.calibrated = is_calibrated(topic.name);
  out.unused = why_unused(topic);
  if (const std::size_t without = topic.images.size() - out.times.size(); without > 0)
    out.notes.push_back(fmt::format("{} images have no time stamp", without));
  if (topic.unreadable > 0) out.notes.push_back(fmt::format("{} messages are damaged", topic.unreadable));
  if (topic.other_sizes > 0)
    out.notes.push_back(fmt::format("{} images have another size or encoding than the first", topic.other_sizes));
  return out;
}

RecordingDescription BagRecording::describe() const {
  RecordingDescription out;
  out.format = std::string(store_->files().front()->format());
  std::map<std::string, StreamDescription> streams;
  for (const auto& file : store_->files()) {
    for (const containers::Topic& topic : file->topics()) {
      StreamDescription& stream = streams[topic.name];
      stream.name = topic.name;
      stream.type = topic.type;
      stream.encoding = topic.serialisation;
      if (topic.count == 0) continue;
      if (stream.count == 0) stream.times = {topic.first_ns, topic.last_ns};
      stream.times = {std::min(stream.times.front(), topic.first_ns), std::max(stream.times.back(), topic.last_ns)};
      stream.count += topic.count;
      stream.stamps = "recording";
    }
  }
  for (const ImageTopic& topic : topics_) streams[topic.name] = describe(topic);
  for (std::size_t c = 0; c < cameras_.size(); ++c) streams[topics_[cameras_[c]].name].camera = static_cast<int>(c);
  for (auto& [name, stream] : streams) out.streams.push_back(std::move(stream));
  out.proposed = proposed_;
  return out;
}

}  // namespace

bool looks_like_bag(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return fs::exists(path / "metadata.yaml", error) || files_of_rosbag2(path).ok();
  if (containers::has_message_file_name(path)) return true;
  const auto file = containers::InputFile::open(path);
  const std::string start = file ? file->read(0, 16) : "";
  return start.starts_with("#ROSBAG V") || start.starts_with("\x89MCAP") || start.starts_with("SQLite format 3");
}

RecordingResult open_bag(const std::vector<fs::path>& paths, const std::vector<std::string>& topics) {
  std::vector<std::string> warnings;
  std::vector<fs::path> files = paths;
  std::error_code error;
  const bool folder = fs::is_directory(paths.front(), error);
  if (folder) {
    auto found = files_of_rosbag2(paths.front());
    if (!found) return found.error();
    files = std::move(found->files);
    warnings = std::move(found->warnings);
  }
  std::vector<std::unique_ptr<containers::MessageFile>> opened;
  std::optional<Error> first_error;
  for (const fs::path& file : files) {
    auto one = containers::open_message_file(file);
    if (one) {
      opened.push_back(*std::move(one));
      continue;
    }
    if (!folder) return one.error();  // files that were requested by name must be readable
    if (!first_error) first_error = one.error();
    warnings.push_back(one.error().message() + "; the file is not read");
  }
  if (opened.empty()) return *first_error;
  auto recording = std::make_unique<BagRecording>(std::make_shared<BagStore>(std::move(opened)), std::move(warnings));
  if (const Status s = recording->choose(topics, paths.front().string()); !s) return s.error();
  return std::unique_ptr<Recording>(std::move(recording));
}

}  // namespace bslam::dataset
