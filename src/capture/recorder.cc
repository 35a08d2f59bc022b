#include "capture/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <utility>

#include "containers/ros_writer.h"
#include "dataset/live_recording.h"
#include "image_decoding/image_file.h"
#include "image_files/png_encoder.h"
#include "rig_formats/bslam_rig.h"

namespace bslam::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxWaiting = 32;                       // frames
constexpr auto kFlushAfter = std::chrono::milliseconds(500);  // maximum duration that is lost if the program is killed

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

// Topics of ROS have names of letters, digits and underscores; those of two cameras must differ.
std::vector<std::string> topics_of(const camera::Rig& rig, const std::vector<bool>& jpeg) {
  std::vector<std::string> out;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    std::string name = rig.camera(c).name;
    std::ranges::replace_if(
        name, [](char k) { return !is_name_character(k); }, '_');
    if (name.empty() || (name[0] >= '0' && name[0] <= '9')) name = "cam_" + name;
    std::string topic = fmt::format("/{}/image_raw{}", name, jpeg[c] ? "/compressed" : "");
    if (std::ranges::find(out, topic) != out.end())
      topic = fmt::format("/{}_{}/image_raw{}", name, c, jpeg[c] ? "/compressed" : "");
    out.push_back(std::move(topic));
  }
  return out;
}

// The rig with its masks as they are named inside the recording.
camera::Rig with_masks_inside(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    std::string& mask = cameras.back().camera.mask_file;
    if (!mask.empty()) mask = dataset::live_mask_file(c);
  }
  return camera::Rig(std::move(cameras), rig.cam_from_rig(0));
}

// The rig comes first, since readers may keep only some of the attachments.
Status attach_rig(const camera::Rig& rig, const std::vector<image::Image>& masks, containers::McapWriter& writer) {
  const std::string text = rig_formats::rig_to_yaml(with_masks_inside(rig));
  if (const Status s = writer.attach(dataset::kLiveRigFile, "application/yaml", text); !s) return s;
  for (std::size_t c = 0; c < masks.size(); ++c) {
    if (masks[c].empty()) continue;
    const std::string png = image_files::encode_grey_png(masks[c]);
    if (const Status s = writer.attach(dataset::live_mask_file(c), "image/png", png); !s) return s;
  }
  return {};
}

}  // namespace

Result<camera::Rig> rig_as_recorded(const camera::Rig& rig) {
  auto reading = rig_formats::read_bslam_rig(dataset::kLiveRigFile, rig_formats::rig_to_yaml(rig));
  if (!reading) return reading.error();
  return camera::Rig(std::move(reading->cameras), reading->T_cam0_rig);
}

Result<std::unique_ptr<Recorder>> Recorder::create(const std::filesystem::path& path, const camera::Rig& rig,
                                                   const std::vector<int>& numbers, const std::vector<bool>& jpeg) {
  const auto masks = image_decoding::read_masks(rig);  // before the file is replaced, which may contain them
  if (!masks) return masks.error();
  auto file = containers::McapWriter::create(path);
  if (!file) return file.error();
  containers::McapWriter& writer = **file;
  const std::vector<std::string> topics = topics_of(rig, jpeg);
  if (const Status s = attach_rig(rig, *masks, writer); !s) return s.error();
  if (const Status s = writer.add_metadata(dataset::kLiveMetadata, dataset::live_metadata(topics, numbers)); !s)
    return s.error();
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (jpeg[c])
      writer.add_topic(topics[c], containers::kCompressedImageType, containers::compressed_image_definition());
    else
      writer.add_topic(topics[c], containers::kImageType, containers::image_definition());
  }
  return std::unique_ptr<Recorder>(new Recorder(path, *std::move(file), rig));
}

Recorder::Recorder(std::filesystem::path path, std::unique_ptr<containers::McapWriter> file, const camera::Rig& rig)
    : path_(std::move(path)), rig_(rig), file_(std::move(file)), thread_([this] { run(); }) {}

Recorder::~Recorder() { [[maybe_unused]] const Status last = finish(); }

bool Recorder::add(const ImageBundle& frame, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait(lock, stop, [this] { return waiting_.size() < kMaxWaiting || !status_; })) return false;
  if (!status_ || ending_) return true;
  waiting_.push_back(frame);
  changed_.notify_all();
  return true;
}

Status Recorder::write(const ImageBundle& frame) {
  const TimeNs frame_ns = time_of(frame, rig_);
  Status status;
  for (std::size_t c = 0; c < frame.images.size() && status; ++c) {
    const CameraImage& image = frame.images[c];
    if (image.data == nullptr) continue;
    const std::string& name = rig_.camera(c).name;
    const std::string& jpeg = pixels_of(image).jpeg;
    const std::string message = jpeg.empty() ? containers::grey_image_message(image.time_ns, name, image.width,
                                                                              image.height, image.data, image.stride)
                                             : containers::jpeg_image_message(image.time_ns, name, jpeg);
    status = file_->write(static_cast<std::uint16_t>(c), frame_ns, message);
  }
  return status;
}

void Recorder::run() {
  try {
    write_frames();
  } catch (const std::exception& failure) {
    const std::lock_guard lock(mutex_);
    status_ = Error{path_.string(), "", failure.what(), "a recording that can go on"};
    changed_.notify_all();
  }
}

void Recorder::write_frames() {
  Clock::time_point flushed = Clock::now();
  std::unique_lock lock(mutex_);
  while (status_) {
    changed_.wait_for(lock, kFlushAfter, [this] { return !waiting_.empty() || ending_; });
    if (waiting_.empty() && ending_) break;
    std::optional<ImageBundle> frame;
    if (!waiting_.empty()) {
      frame = std::move(waiting_.front());
      waiting_.pop_front();
      changed_.notify_all();
    }
    lock.unlock();
    Status status = frame ? write(*frame) : Status();
    if (status && Clock::now() - flushed >= kFlushAfter) {
      status = file_->flush();
      flushed = Clock::now();
    }
    lock.lock();
    frames_ += frame && status;
    status_ = status;
  }
  changed_.notify_all();
}

Status Recorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }
  if (!thread_.joinable()) return status_;  // finished before
  thread_.join();
  const std::lock_guard lock(mutex_);
  if (status_) status_ = file_->finish();
  bytes_ = file_->bytes();
  return status_;
}

std::size_t Recorder::frames() const {
  const std::lock_guard lock(mutex_);
  return frames_;
}

std::uint64_t Recorder::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace bslam::capture
