#include "storage/map_sections.h"

#include <cmath>
#include <utility>

#include "camera/camera_description.h"

namespace bslam::storage {
namespace {

using geometry::Quaterniond;
using geometry::SE3;
using geometry::Vector3d;

constexpr double kUnitTolerance = 1e-12;
constexpr double kMaxCoordinate = 1e30;  // metres, or units of a map without metric scale
constexpr int kMaxLevels = 32;
constexpr std::size_t kCameraBytes = 3 * 4 + 2 * 4 + 4 * 8 + kTransformBytes + 8 + 4;  // minimum

// The constructor of SE3 normalises its quaternion, which may change the last bits of one that is already normalised.
// Since `q` is the result of a normalisation, its multiples differ only by rounding, and one of the first few
// normalises to exactly `q`. If none does, `q` was not taken from an SE3 and is simply normalised.
SE3 with_exact_rotation(const Quaterniond& q, const Vector3d& translation) {
  constexpr int kTries = 1 << 14;
  for (int i = 0; i < kTries; ++i) {
    const Quaterniond multiple((1 + static_cast<double>(i) / kTries * 4) * q.coeffs());
    const SE3 transform(multiple, translation);
    if (transform.rotation().coeffs() == q.coeffs()) return transform;
  }
  return SE3(q, translation);
}

camera::CameraDescription take_description(SectionReader& in) {
  camera::CameraDescription d;
  d.name = in.text();
  d.model = in.text();
  d.resolution = {in.number<std::int32_t>(), in.number<std::int32_t>()};
  d.intrinsics.resize(4);
  in.numbers(d.intrinsics.data(), 4);
  d.distortion.resize(in.count(sizeof(double)));
  in.numbers(d.distortion.data(), d.distortion.size());
  return d;
}

// Checks the same conditions as for rig files, without changing the numbers.
std::optional<camera::RigCamera> take_rig_camera(SectionReader& in) {
  camera::CameraDescription d = take_description(in);
  const SE3 T_body_cam = take_transform(in);
  const auto offset_ns = in.number<TimeNs>();
  in.text();  // the path of a mask, in maps of older versions
  if (!in.ok()) return {};
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = T_body_cam.matrix();
  d.T_body_cam.assign(rows.data(), rows.data() + rows.size());
  d.time_offset_s = to_seconds(offset_ns);
  auto camera = camera::make_camera(
      d, {"", "model", "resolution", "intrinsics", "distortion", "T_body_cam", "time_offset", "readout"});
  if (!camera) {
    const Error& error = camera.error();
    in.require(false, error.key + " " + error.found, error.expected);
    return {};
  }
  camera->T_body_cam = T_body_cam;
  camera->camera.time_offset_ns = offset_ns;
  return *std::move(camera);
}

std::vector<double> readouts_of(const camera::Rig& rig) {
  std::vector<double> out;
  for (std::size_t i = 0; i < rig.size(); ++i) out.push_back(rig.camera(i).readout_s);
  return out;
}

// The readout times of rolling shutters, one per camera. They are omitted if all are 0.
void take_readouts(SectionReader& in, std::vector<camera::RigCamera>& cameras) {
  for (camera::RigCamera& camera : cameras) {
    camera.camera.readout_s = in.number<double>();
    in.require(std::abs(camera.camera.readout_s) <= 1, "an invalid readout time", "at most 1 second");
  }
}

}  // namespace

FileIds::FileIds(const map::BundledMap& map) : keyframe(map.keyframe_slots()) {
  std::size_t next = 0;
  for (const KeyframeId k : map.keyframe_ids()) keyframe[k.index()] = KeyframeId(next++);
}

KeyframeId FileIds::nearest_older(KeyframeId k) const {
  for (std::size_t i = k.index() + 1; i-- > 0;) {
    if (keyframe[i].valid()) return keyframe[i];
  }
  return KeyframeId(0);
}

bool is_plausible(const Eigen::Vector3d& point) { return (point.array().abs() <= kMaxCoordinate).all(); }

void put_transform(const SE3& transform, ByteWriter& out) {
  out.numbers(transform.rotation().coeffs().data(), 4);
  out.numbers(transform.translation().data(), 3);
}

SE3 take_transform(SectionReader& in) {
  Eigen::Vector4d xyzw;
  Vector3d translation;
  in.numbers(xyzw.data(), 4);
  in.numbers(translation.data(), 3);
  if (!in.ok() ||
      !in.require(std::abs(xyzw.squaredNorm() - 1) <= kUnitTolerance, "a rotation that is not a unit quaternion",
                  "a unit quaternion") ||
      !in.require(is_plausible(translation), "an invalid translation", "finite coordinates")) {
    return {};
  }
  return with_exact_rotation(Quaterniond(xyzw), translation);
}

namespace {

void put_cameras(const camera::Rig& rig, ByteWriter& out) {
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const camera::Camera& c = rig.camera(i);
    out.text(c.name);
    out.text(camera::model_name(c.model));
    out.number(std::int32_t{c.width});
    out.number(std::int32_t{c.height});
    const camera::Intrinsics& k = camera::intrinsics(c.model);
    for (const double value : {k.fx, k.fy, k.cx, k.cy}) out.number(value);
    const std::vector<double> distortion = camera::distortion(c.model);
    out.count(distortion.size());
    out.numbers(distortion.data(), distortion.size());
    put_transform(rig.body_from_cam(i), out);
    out.number(c.time_offset_ns);
    out.text("");  // a mask belongs to the recording, and its path to one machine
  }
  const auto readouts = readouts_of(rig);
  out.numbers(readouts.data(), readouts.size());
  put_transform(rig.cam_from_rig(0), out);
  out.count(rig.moves().size());
  for (const camera::CameraMove& move : rig.moves()) {
    out.number(static_cast<std::uint32_t>(move.camera));
    out.number(move.time_ns);
    put_transform(move.T_after_initial, out);
  }
}

std::vector<camera::CameraMove> take_moves(SectionReader& in, std::size_t cameras) {
  constexpr std::size_t kMoveBytes = 4 + 8 + 7 * 8;
  std::vector<camera::CameraMove> moves(in.count(kMoveBytes));
  for (camera::CameraMove& move : moves) {
    move.camera = in.number<std::uint32_t>();
    move.time_ns = in.number<TimeNs>();
    move.T_after_initial = take_transform(in);
    in.require(move.camera < cameras, "a move of camera " + std::to_string(move.camera), "a camera of the rig");
    if (!in.ok()) return {};
  }
  in.require(std::ranges::is_sorted(moves, {}, &camera::CameraMove::time_ns), "moves of cameras out of order",
             "moves in order of time");
  return moves;
}

// `version`: of the file, see docs/map_file.md.
std::shared_ptr<const camera::Rig> take_cameras(SectionReader& in, std::size_t n, std::uint32_t version) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < n && in.ok(); ++i) {
    in.enter("camera", i);
    if (auto camera = take_rig_camera(in)) cameras.push_back(*std::move(camera));
    in.leave();
  }
  if (in.ok() && (version >= 3 || in.remaining() > 0)) take_readouts(in, cameras);
  const SE3 T_cam0_rig = version >= 4 ? take_transform(in) : SE3();
  in.require(T_cam0_rig.translation().isZero(0), "a rig frame with another origin than camera 0", "a rotation");
  std::vector<camera::CameraMove> moves;
  if (version >= 6) moves = take_moves(in, cameras.size());
  if (!in.ok()) return {};
  return std::make_shared<const camera::Rig>(camera::Rig(std::move(cameras), T_cam0_rig).with_moves(std::move(moves)));
}

}  // namespace

void put_rigs(const map::BundledMap& map, ByteWriter& out) {
  out.count(map.rig().size());
  put_cameras(map.rig(), out);
  put_cameras(map.given_rig(), out);
}

std::optional<RigSection> take_rigs(SectionReader& in, std::uint32_t version) {
  const std::size_t n = in.count(kCameraBytes);
  in.require(n >= 1 && n <= kMaxCameras, std::to_string(n) + " cameras", "1 to " + std::to_string(kMaxCameras));
  if (!in.ok()) return {};
  RigSection section;
  section.rig = section.given = take_cameras(in, n, version);
  if (in.ok() && version >= 3) section.given = take_cameras(in, n, version);
  if (version >= 5) in.align();
  if (!in.finish()) return {};
  return section;
}

void put_info(const map::BundledMap& map, const MapFileInfo& info, ByteWriter& out) {
  out.number(map.pyramid().scale_factor);
  out.number(std::int32_t{map.pyramid().levels});
  out.number(static_cast<std::uint8_t>(map.scale()));
  out.text(place::kDescriptorKind);
  out.number(info.vocabulary);
  out.text(info.version);
  out.text(info.data);
  out.text(info.warning);
}

InfoSection take_info(SectionReader& in, std::uint32_t version) {
  InfoSection section;
  section.pyramid.scale_factor = in.number<double>();
  section.pyramid.levels = in.number<std::int32_t>();
  const auto scale = in.number<std::uint8_t>();
  const std::string kind = in.text();
  section.info = {in.number<std::uint64_t>(), in.text(), in.text(), {}};
  if (version >= 5 || in.remaining() > 0) {
    section.info.warning = in.text();
    in.require(version >= 5 || !section.info.warning.empty(), "an empty warning", "a warning, or none");
  }
  section.scale = static_cast<map::Scale>(scale);
  const bool pyramid = section.pyramid.scale_factor > 1 && section.pyramid.scale_factor <= 4 &&
                       section.pyramid.levels >= 1 && section.pyramid.levels <= kMaxLevels;
  in.require(pyramid, "an invalid pyramid", "1 to 32 levels and a scale factor in (1, 4]");
  in.require(scale <= static_cast<int>(map::Scale::kUnobservable), "an unknown scale",
             "metric, up to scale or unobservable");
  in.require(kind == place::kDescriptorKind, "features of kind " + kind, std::string(place::kDescriptorKind));
  if (version >= 5) in.align();
  in.finish();
  return section;
}

}  // namespace bslam::storage
