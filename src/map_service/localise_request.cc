#include "map_service/localise_request.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "image_decoding/image_file.h"
#include "image_decoding/image_size.h"
#include "system/input_check.h"
#include "web_server/multipart.h"

namespace bslam::map_service {
namespace {

// A progressive JPEG may have any number of scans, each of which takes the time of a whole image.
constexpr std::size_t kMaxScans = 64;

// A name that the client has sent, as it may occur in an error.
std::string shown(std::string_view name) {
  constexpr std::size_t kLength = 40;
  std::string out(name.substr(0, kLength));
  for (char& c : out) {
    if (c < ' ' || c > '~') c = '?';
  }
  return "'" + out + (name.size() > kLength ? "...'" : "'");
}

std::string names_of(const camera::Rig& rig) {
  std::string out;
  for (std::size_t c = 0; c < rig.size(); ++c) out += (c == 0 ? "" : ", ") + rig.camera(c).name;
  return out;
}

std::optional<std::size_t> camera_named(const camera::Rig& rig, std::string_view name) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig.camera(c).name == name) return c;
  }
  return std::nullopt;
}

bool has_too_many_scans(std::string_view bytes) {
  constexpr std::string_view kStartOfScan = "\xff\xda";
  if (!bytes.starts_with("\xff\xd8")) return false;
  std::size_t scans = 0;
  for (std::size_t at = bytes.find(kStartOfScan); at != std::string_view::npos && scans <= kMaxScans;
       at = bytes.find(kStartOfScan, at + kStartOfScan.size()))
    ++scans;
  return scans > kMaxScans;
}

Result<image::Image> decode(std::string_view bytes, const camera::Camera& camera) {
  const Error damaged{"request", camera.name, "an incomplete image or another format",
                      "a complete PNG, JPEG, WebP or PGM image"};
  const auto size = image_decoding::size_in_header(bytes);
  if (!size || size->width > INT32_MAX || size->height > INT32_MAX) return damaged;
  // Before anything is allocated for the pixels.
  if (const Status s =
          system::check_size(static_cast<int>(size->width), static_cast<int>(size->height), camera, "request");
      !s)
    return s.error();
  if (has_too_many_scans(bytes)) return damaged;
  auto image = image_decoding::decode_grey(bytes);
  if (!image) return damaged;
  if (const Status s = system::check_size(image->width(), image->height(), camera, "request"); !s) return s.error();
  return *std::move(image);
}

// The time of camera 0's image, or of the earliest other one.
TimeNs time_of(const image::ImageBundle& bundle) {
  std::optional<TimeNs> earliest;
  if (bundle.images.front().state == image::ImageState::kPresent) return bundle.images.front().time_ns;
  for (const image::CameraImage& i : bundle.images) {
    if (i.state == image::ImageState::kPresent) earliest = std::min(earliest.value_or(i.time_ns), i.time_ns);
  }
  return earliest.value_or(0);
}

}  // namespace

Result<image::ImageBundle> images_of_request(std::string_view content_type, std::string_view body,
                                             const camera::Rig& rig) {
  const auto parts = web_server::parse_form(content_type, body, {.parts = rig.size()});
  if (!parts) return parts.error();
  if (parts->empty()) return Error{"form", "", "no part", "an image of one of the cameras " + names_of(rig)};
  image::ImageBundle bundle{FrameId(0), 0, std::vector<image::CameraImage>(rig.size())};
  for (const web_server::FormPart& part : *parts) {
    const auto c = camera_named(rig, part.name);
    if (!c) return Error{"form", "", "a part " + shown(part.name), "names of cameras: " + names_of(rig)};
    image::CameraImage& to = bundle.images[*c];
    if (to.state == image::ImageState::kPresent)
      return Error{"form", "", "the part " + rig.camera(*c).name + " twice", "one image per camera"};
    auto image = decode(part.content, rig.camera(*c));
    if (!image) return image.error();
    to = {.state = image::ImageState::kPresent, .time_ns = rig.camera(*c).time_offset_ns, .image = *std::move(image)};
  }
  bundle.time_ns = time_of(bundle);
  return bundle;
}

}  // namespace bslam::map_service
