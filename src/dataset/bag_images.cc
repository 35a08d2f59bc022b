#include "dataset/bag_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "base/max_image_side.h"
#include "dataset/image_names.h"
#include "image_decoding/image_file.h"
#include "image_files/image_size.h"

namespace bslam::dataset {
namespace {

using containers::ImageMessage;
using image_files::PixelLayout;
using image_files::StoredImage;

struct Encoding {
  std::string_view name;
  PixelLayout layout;
  int bytes_per_value;
};

// sensor_msgs/image_encodings.h. mono8 and the like name what an image is, 8UC1 and the like only how it is stored.
constexpr Encoding kEncodings[] = {
    {"mono8", PixelLayout::kGrey, 1},        {"8UC1", PixelLayout::kGrey, 1},
    {"mono16", PixelLayout::kGrey, 2},       {"16UC1", PixelLayout::kGrey, 2},
    {"rgb8", PixelLayout::kRgb, 1},          {"bgr8", PixelLayout::kBgr, 1},
    {"8UC3", PixelLayout::kBgr, 1},          {"rgba8", PixelLayout::kRgba, 1},
    {"bgra8", PixelLayout::kBgra, 1},        {"8UC4", PixelLayout::kBgra, 1},
    {"rgb16", PixelLayout::kRgb, 2},         {"bgr16", PixelLayout::kBgr, 2},
    {"rgba16", PixelLayout::kRgba, 2},       {"bgra16", PixelLayout::kBgra, 2},
    {"bayer_rggb8", PixelLayout::kRggb, 1},  {"bayer_bggr8", PixelLayout::kBggr, 1},
    {"bayer_grbg8", PixelLayout::kGrbg, 1},  {"bayer_gbrg8", PixelLayout::kGbrg, 1},
    {"bayer_rggb16", PixelLayout::kRggb, 2}, {"bayer_bggr16", PixelLayout::kBggr, 2},
    {"bayer_grbg16", PixelLayout::kGrbg, 2}, {"bayer_gbrg16", PixelLayout::kGbrg, 2},
    {"yuv422", PixelLayout::kUyvy, 1},       {"uyvy", PixelLayout::kUyvy, 1},
    {"yuv422_yuy2", PixelLayout::kYuyv, 1},  {"yuyv", PixelLayout::kYuyv, 1},
};

const Encoding* find_encoding(std::string_view name) {
  const auto found = std::ranges::find(kEncodings, name, &Encoding::name);
  return found == std::end(kEncodings) ? nullptr : &*found;
}

// The colour filter of a compressed image, whose format is that of the camera's images and, after `compressed`, that of
// the file if it differs: "bayer_rggb8; jpeg compressed " has a filter, and "bayer_rggb8; jpeg compressed bgr8" has
// none.
PixelLayout filter_in(std::string_view format) {
  constexpr std::string_view kCompressed = "compressed";
  const std::size_t end = format.find(';'), at = format.find(kCompressed);
  if (!format.starts_with("bayer_") || end == std::string_view::npos) return PixelLayout::kFile;
  std::string_view file = at == std::string_view::npos ? "" : format.substr(at + kCompressed.size());
  file.remove_prefix(std::min(file.find_first_not_of(' '), file.size()));
  const Encoding* encoding = find_encoding(format.substr(0, end));
  const bool kept = file.empty() || file.starts_with("bayer_");
  return kept && encoding != nullptr ? encoding->layout : PixelLayout::kFile;
}

// The numbers of the files of a recording in the order in which they were begun. The messages of one file stay in its
// order: their times step back where the clock of the recording computer did.
std::vector<std::uint32_t> files_by_time(const std::vector<std::unique_ptr<containers::MessageFile>>& files) {
  std::vector<std::uint32_t> out(files.size());
  std::iota(out.begin(), out.end(), 0u);
  std::ranges::stable_sort(out, {}, [&](std::uint32_t f) {
    const auto& messages = files[f]->messages();
    return messages.empty() ? TimeNs{0} : messages.front().received_ns;
  });
  return out;
}

constexpr std::size_t kBeginning = 512;  // bytes that contain everything before the pixels, unless names are very long

}  // namespace

const containers::Topic& BagStore::topic_of(const Entry& entry) const {
  return files_[entry.file]->topics()[entry.message.topic];
}

std::vector<ImageTopic> BagStore::find_images() {
  std::map<std::pair<std::string, std::string>, ImageTopic> topics;  // by name and type
  std::map<const ImageTopic*, ImageMessage> first;
  for (const std::uint32_t f : files_by_time(files_)) {
    for (const containers::MessageRef& message : files_[f]->messages()) {
      const containers::Topic& from = files_[f]->topics()[message.topic];
      if (!containers::is_image_type(from.type)) continue;
      ImageTopic& topic = topics[{from.name, from.type}];
      topic.name = from.name;
      topic.type = from.type;
      auto bytes = files_[f]->read(message, kBeginning);
      auto image = bytes ? containers::parse_image(from, *bytes) : std::nullopt;
      if (bytes && !image && bytes->size() >= kBeginning) {
        bytes = files_[f]->read(message, containers::kWholeMessage);
        image = bytes ? containers::parse_image(from, *bytes) : std::nullopt;
      }
      if (!image) {
        ++topic.unreadable;
        continue;
      }
      const ImageMessage& reference = first.try_emplace(&topic, *image).first->second;
      topic.other_sizes +=
          image->width != reference.width || image->height != reference.height || image->encoding != reference.encoding;
      topic.images.push_back({image->stamp_ns, message.received_ns, static_cast<std::int64_t>(entries_.size())});
      entries_.push_back({message, f});
    }
  }
  std::vector<ImageTopic> out;
  for (auto& [key, topic] : topics) {
    if (const auto reference = first.find(&topic); reference != first.end()) {
      topic.encoding = reference->second.encoding;
      topic.width = static_cast<int>(std::min<std::uint32_t>(reference->second.width, kMaxImageSidePx + 1));
      topic.height = static_cast<int>(std::min<std::uint32_t>(reference->second.height, kMaxImageSidePx + 1));
    }
    describe_first(topic);
    out.push_back(std::move(topic));
  }
  std::ranges::stable_sort(out, naturally_before, &ImageTopic::name);
  return out;
}

// Finds the size of a topic of compressed images, and whether images can be read.
void BagStore::describe_first(ImageTopic& topic) const {
  if (topic.images.empty()) {
    topic.unusable = "no message can be read";
    return;
  }
  const bool compressed = topic.type.ends_with("CompressedImage");
  if (!compressed) {
    if (find_encoding(topic.encoding) == nullptr) topic.unusable = "encoding " + topic.encoding + " is not supported";
    return;
  }
  if (topic.encoding.find("compressedDepth") != std::string::npos) {
    topic.unusable = "depth images";
    return;
  }
  constexpr std::size_t kTries = 5;
  for (std::size_t k = 0; k < std::min(kTries, topic.images.size()); ++k) {
    const auto image = read(topic.images[k].entry);
    if (!image) continue;
    const std::string_view file = std::string_view(image->bytes).substr(image->begin, image->size);
    if (const auto size = image_files::image_size(file)) {
      topic.width = size->width;
      topic.height = size->height;
      return;
    }
    if (const auto decoded = image_decoding::decode_stored(*image)) {
      topic.width = decoded->width();
      topic.height = decoded->height();
      return;
    }
  }
  const bool known = topic.encoding.find("jp") != std::string::npos ||
                     topic.encoding.find("png") != std::string::npos ||
                     topic.encoding.find("webp") != std::string::npos;
  if (!known) topic.unusable = "format " + topic.encoding + " is not supported";
}

Result<StoredImage> BagStore::read(std::int64_t number) const {
  const Entry& entry = entries_.at(static_cast<std::size_t>(number));
  auto bytes = files_[entry.file]->read(entry.message, containers::kWholeMessage);
  if (!bytes) return Error{name(number), "", bytes.error().found, bytes.error().expected};
  const auto image = containers::parse_image(topic_of(entry), *bytes);
  if (!image) return Error{name(number), "", "a damaged message", "an image"};
  if (image->data_at > bytes->size() || image->data_size > bytes->size() - image->data_at)
    return Error{name(number), "", "an image that is cut off", fmt::format("{} bytes", image->data_size)};
  StoredImage out{.bytes = *std::move(bytes),
                  .begin = static_cast<std::size_t>(image->data_at),
                  .size = static_cast<std::size_t>(image->data_size)};
  if (image->compressed) {
    out.filter = filter_in(image->encoding);
    return out;
  }
  const Encoding* encoding = find_encoding(image->encoding);
  if (encoding == nullptr) return Error{name(number), "", "encoding " + image->encoding, "a supported encoding"};
  if (image->width < 1 || image->height < 1 || image->width > kMaxImageSidePx || image->height > kMaxImageSidePx)
    return Error{name(number), "", fmt::format("{}x{} pixels", image->width, image->height), "1 to 20000 pixels"};
  out.layout = encoding->layout;
  out.bytes_per_value = encoding->bytes_per_value;
  out.width = static_cast<int>(image->width);
  out.height = static_cast<int>(image->height);
  out.step = image->step;
  out.big_endian = image->big_endian;
  return out;
}

std::string BagStore::name(std::int64_t number) const {
  const Entry& entry = entries_.at(static_cast<std::size_t>(number));
  return fmt::format("{}: {}: the image recorded at {} ns", files_[entry.file]->path().string(), topic_of(entry).name,
                     entry.message.received_ns);
}

std::string BagStore::source(std::int64_t number) const {
  const Entry& entry = entries_.at(static_cast<std::size_t>(number));
  return fmt::format("{}: {}", files_[entry.file]->path().string(), topic_of(entry).name);
}

std::string BagStore::stream(std::int64_t number) const {
  return topic_of(entries_.at(static_cast<std::size_t>(number))).name;
}

}  // namespace bslam::dataset
