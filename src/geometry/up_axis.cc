#include "geometry/up_axis.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "base/split.h"

namespace bslam::geometry {
namespace {

std::optional<double> number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Vector3d> direction(const std::string& text) {
  const bool negative = text.starts_with('-');
  const std::string letter = negative ? text.substr(1) : text;
  if (letter == "x" || letter == "y" || letter == "z") {
    const Vector3d axis = Vector3d::Unit(letter[0] - 'x');
    return negative ? Vector3d(-axis) : axis;
  }
  const std::vector<std::string> parts = split(text, ',');
  if (parts.size() != 3) return std::nullopt;
  Vector3d out;
  for (int i = 0; i < 3; ++i) {
    const auto value = number(parts[static_cast<std::size_t>(i)]);
    if (!value) return std::nullopt;
    out[i] = *value;
  }
  const double length = out.stableNorm();
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  return Vector3d(out / length);
}

}  // namespace

Result<UpAxis> parse_up_axis(const std::string& text) {
  using enum UpAxis::Frame;
  const std::size_t colon = text.find(':');
  const std::string frame = text.substr(0, colon);
  const auto axis = colon == std::string::npos ? std::nullopt : direction(text.substr(colon + 1));
  if (!axis || (frame != "camera" && frame != "body" && frame != "world"))
    return Error{"command line", "--up", text,
                 "an axis of body, camera or world that points upward, such as body:z, camera:-y or world:0,-1,0.2"};
  return UpAxis{frame == "camera" ? kCamera : frame == "body" ? kBody : kWorld, *axis};
}

Result<Vector3d> up_in_world(const UpAxis& axis, std::span<const SE3> T_world_cam0, const SE3& T_body_cam0) {
  constexpr double kMinMean = 0.5;  // length of the mean of unit vectors; axes within 60 degrees of it
  if (axis.frame == UpAxis::Frame::kWorld) return axis.direction;
  const Vector3d in_cam0 =
      axis.frame == UpAxis::Frame::kBody ? Vector3d(T_body_cam0.rotation().inverse() * axis.direction) : axis.direction;
  Vector3d mean = Vector3d::Zero();
  for (const SE3& T : T_world_cam0) mean += T.rotation() * in_cam0 / static_cast<double>(T_world_cam0.size());
  if (mean.norm() < kMinMean)
    return Error{"command line", "--up", "an axis that points everywhere during the recording",
                 "an axis that points upward most of the time"};
  return Vector3d(mean.normalized());
}

}  // namespace bslam::geometry
