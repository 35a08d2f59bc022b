#include "map/rigs_of_map.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/assert.h"
#include "camera/model_parameters.h"
#include "camera/unused_name.h"

namespace bslam::map {
namespace {

// The text of a rig file rounds rotations.
constexpr double kRelative = 1e-9, kMaxAngle = 1e-7, kMaxShift = 1e-7;  // -, rad, metres

bool same_camera(const camera::Camera& a, const camera::Camera& b) {
  if (a.model.index() != b.model.index() || a.width != b.width || a.height != b.height) return false;
  if (a.time_offset_ns != b.time_offset_ns || std::abs(a.readout_s - b.readout_s) > kRelative) return false;
  const auto pa = camera::parameters(a.model), pb = camera::parameters(b.model);
  return std::ranges::equal(pa, pb, [](double x, double y) {
    return std::abs(x - y) <= kRelative * std::max({1.0, std::abs(x), std::abs(y)});
  });
}

bool same_pose(const geometry::SE3& a, const geometry::SE3& b) {
  const geometry::SE3 D = a * b.inverse();
  return geometry::so3_log(D.rotation()).norm() <= kMaxAngle && D.translation().norm() <= kMaxShift;
}

// Whether camera `c` may be the first one of a rig: it has the origin of the rig frame, and at most the rotation by
// which a refined calibration turned it. Other cameras that share an origin are turned further, to see something else.
bool may_begin_rig(const camera::Rig& given, std::size_t c) {
  constexpr double kMaxTurn = 0.1;  // rad; a principal point that was wrong by 5 % of the width of 90 degrees
  const geometry::SE3& T_cam_rig = given.cam_from_rig(c);
  return T_cam_rig.translation().norm() <= kMaxShift && geometry::so3_log(T_cam_rig.rotation()).norm() <= kMaxTurn;
}

// Returns true if the name is the original name of other cameras of the rig, but not of this one. Two cameras may have
// the same calibration, so that only their names distinguish them.
bool names_another(const camera::Rig& given, std::size_t camera, const std::string& name) {
  if (given.camera(camera).name == name) return false;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given.camera(i).name == name) return true;
  }
  return false;
}

// Whether the cameras of `part` are those of `whole` from `first` on. `given`: with their names as they were given.
bool contains(const camera::Rig& whole, const camera::Rig& given, std::size_t first, const camera::Rig& part) {
  for (std::size_t i = 0; i < part.size(); ++i) {
    if (!same_camera(whole.camera(first + i), part.camera(i))) return false;
    if (names_another(given, first + i, part.camera(i).name)) return false;
    if (!same_pose(whole.cam_from_rig(first + i), part.cam_from_rig(i))) return false;
  }
  return true;
}

std::vector<camera::RigCamera> cameras(const camera::Rig& rig) {
  std::vector<camera::RigCamera> out;
  for (std::size_t i = 0; i < rig.size(); ++i) out.push_back({rig.camera(i), rig.body_from_cam(i)});
  return out;
}

// The cameras of `part` as cameras of a rig with the body frame of `whole`.
std::vector<camera::RigCamera> moved_into(const camera::Rig& whole, const camera::Rig& part) {
  std::vector<camera::RigCamera> out;
  for (std::size_t i = 0; i < part.size(); ++i)
    out.push_back({part.camera(i), whole.body_from_rig() * part.rig_from_cam(i)});
  return out;
}

// Adds the moves of cameras of a rig, whose camera 0 is camera `first` of another one.
void add_moves(const camera::Rig& rig, std::size_t first, std::vector<camera::CameraMove>& moves) {
  for (const camera::CameraMove& move : rig.moves())
    moves.push_back({first + move.camera, move.time_ns, move.T_after_initial});
}

// Appends a rig with its calibration as it was given and as it is, and returns the index of its first camera.
std::size_t append_rig(BundledMap& map, const camera::Rig& given_rig, const camera::Rig& rig) {
  const std::size_t first = map.rig().size();
  std::vector<camera::RigCamera> all = cameras(map.rig()), given = cameras(map.given_rig());
  for (camera::RigCamera& added : moved_into(map.rig(), rig)) {
    added.camera.name = camera::unused_name(all, added.camera.name);
    all.push_back(std::move(added));
  }
  std::ranges::move(moved_into(map.given_rig(), given_rig), std::back_inserter(given));
  std::vector<camera::CameraMove> moves;
  add_moves(map.rig(), 0, moves);
  add_moves(rig, first, moves);
  const camera::Rig extended(std::move(all), map.rig().cam_from_rig(0));
  map.append_cameras(std::make_shared<const camera::Rig>(extended.with_moves(std::move(moves))),
                     std::make_shared<const camera::Rig>(std::move(given), map.given_rig().cam_from_rig(0)));
  return first;
}

// The numbers of cameras of the rigs of a map, in order. A rig begins with a camera that may be its first one and
// shares no keyframe with a camera before it.
std::vector<std::size_t> sizes_of_rigs(const BundledMap& map) {
  const std::size_t n = map.rig().size();
  std::vector<std::uint8_t> begins(n);
  for (std::size_t c = 1; c < n; ++c) begins[c] = may_begin_rig(map.given_rig(), c);
  for (const KeyframeId k : map.keyframe_ids()) {
    bool any = false;
    for (std::size_t c = 0; c < n; ++c) {
      const bool used = !map.keyframe(k).frame->cameras[c].keypoints.empty();
      if (any && used) begins[c] = 0;
      any |= used;
    }
  }
  std::vector<std::size_t> out(1);
  for (std::size_t c = 0; c < n; ++c) {
    if (begins[c]) out.push_back(0);
    ++out.back();
  }
  return out;
}

using Cameras = std::vector<std::optional<std::size_t>>;

// The rig of a map, with its calibration as it was given or as it is.
struct PartOfMap {
  const camera::Rig& names;  // with the names that the cameras were given
  camera::Rig rig;
};

bool may_be_same(const PartOfMap& part, std::size_t c, const camera::Rig& rig, std::size_t i) {
  return same_camera(part.rig.camera(c), rig.camera(i)) && !names_another(part.names, c, rig.camera(i).name) &&
         !names_another(rig, i, part.names.camera(c).name);
}

// The cameras of `rig` that those of the part are if camera `c` is camera `i`.
Cameras cameras_with(const PartOfMap& part, std::size_t c, const camera::Rig& rig, std::size_t i) {
  Cameras out(part.rig.size());
  for (std::size_t d = 0; d < out.size(); ++d) {
    const geometry::SE3 T_d_c = part.rig.cam_from_rig(d) * part.rig.rig_from_cam(c);
    for (std::size_t j = 0; j < rig.size() && !out[d]; ++j) {
      const bool taken = std::ranges::count(out, std::optional(j)) > 0;
      if (!taken && may_be_same(part, d, rig, j) && same_pose(T_d_c, rig.cam_from_rig(j) * rig.rig_from_cam(i)))
        out[d] = j;
    }
  }
  return out;
}

// Empty if the part and `rig` are different rigs.
Cameras same_cameras(const PartOfMap& part, const camera::Rig& rig) {
  const auto smaller = static_cast<std::ptrdiff_t>(std::min(part.rig.size(), rig.size()));
  for (std::size_t c = 0; c < part.rig.size(); ++c) {
    for (std::size_t i = 0; i < rig.size(); ++i) {
      if (!may_be_same(part, c, rig, i)) continue;
      Cameras found = cameras_with(part, c, rig, i);
      if (std::ranges::count_if(found, [](const auto& camera) { return camera.has_value(); }) == smaller) return found;
    }
  }
  return {};
}

// Whether the cameras from `first` on are those of `rig` after moves of them.
bool contains_after_moves(const BundledMap& map, std::size_t first, const camera::Rig& rig) {
  if (map.rig().moves().empty()) return false;
  const camera::Rig of_map = cameras_of(map.rig(), first, rig.size());
  return contains(of_map.after_moves(), cameras_of(map.given_rig(), first, rig.size()), 0, rig);
}

}  // namespace

void BundledMap::append_cameras(std::shared_ptr<const camera::Rig> rig, std::shared_ptr<const camera::Rig> given) {
  BSLAM_ASSERT(rig->size() >= rig_->size() && rig->size() == given->size(), "cameras can only be added");
  rig_ = std::move(rig);
  given_rig_ = std::move(given);
  rig_deviation_.reset();
  for (const KeyframeId k : keyframe_ids()) {
    frame::BundledFrame frame = *keyframe(k).frame;
    frame.cameras.resize(rig_->size());
    keyframes_.mutate(k.index(), owner_.tag()).frame = std::make_shared<const frame::BundledFrame>(std::move(frame));
  }
}

std::optional<std::size_t> find_rig(const BundledMap& map, const camera::Rig& rig) {
  std::optional<std::size_t> moved;
  for (std::size_t first = 0; first + rig.size() <= map.rig().size(); ++first) {
    if (first > 0 && !may_begin_rig(map.given_rig(), first)) continue;  // within another rig
    const camera::Rig& given = map.given_rig();
    const bool at_begin = contains(given, given, first, rig) || contains(map.rig(), given, first, rig);
    if (!at_begin && !contains_after_moves(map, first, rig)) continue;
    if (cameras_of(map.rig(), first, rig.size()).moves().empty()) return first;
    if (!moved) moved = first;
  }
  return moved;
}

std::size_t find_or_append_rig(BundledMap& map, const camera::Rig& rig) {
  const auto found = find_rig(map, rig);
  if (!found) return append_rig(map, rig, rig);
  const camera::Rig of_map = cameras_of(map.rig(), *found, rig.size());
  if (of_map.moves().empty()) return *found;
  return append_rig(map, cameras_of(map.given_rig(), *found, rig.size()), of_map.after_moves());
}

std::vector<CameraIndex> find_or_append_rigs(BundledMap& map, const BundledMap& other) {
  std::vector<CameraIndex> out;
  for (const std::size_t size : sizes_of_rigs(other)) {
    const camera::Rig given = cameras_of(other.given_rig(), out.size(), size);
    const camera::Rig rig = cameras_of(other.rig(), out.size(), size);
    auto found = find_rig(map, given);
    // The moves of a recording do not apply to another one. If there are any, the same extrinsics are needed.
    if (!rig.moves().empty() || (found && !cameras_of(map.rig(), *found, size).moves().empty())) found.reset();
    const bool any_moves = !map.rig().moves().empty() || !other.rig().moves().empty();
    if (found && any_moves && !contains(map.rig(), map.given_rig(), *found, rig)) found.reset();
    const std::size_t first = found ? *found : append_rig(map, given, rig);
    for (std::size_t i = 0; i < size; ++i) out.emplace_back(first + i);
  }
  return out;
}

std::vector<std::optional<std::size_t>> find_cameras(const BundledMap& map, const camera::Rig& rig) {
  Cameras out;
  for (const std::size_t size : sizes_of_rigs(map)) {
    const camera::Rig given = cameras_of(map.given_rig(), out.size(), size);
    Cameras found = same_cameras({given, given}, rig);
    if (found.empty()) found = same_cameras({given, cameras_of(map.rig(), out.size(), size)}, rig);
    found.resize(size);
    out.insert(out.end(), found.begin(), found.end());
  }
  return out;
}

std::vector<std::size_t> first_cameras_of_rigs(const BundledMap& map) {
  std::vector<std::size_t> out;
  for (const std::size_t size : sizes_of_rigs(map)) out.insert(out.end(), size, out.size());
  return out;
}

camera::Rig with_cameras(const camera::Rig& whole, std::size_t first, const camera::Rig& part) {
  BSLAM_ASSERT(first + part.size() <= whole.size(), "the cameras must be part of the rig");
  if (part.size() == whole.size()) return part;
  std::vector<camera::RigCamera> out = cameras(whole);
  std::ranges::move(moved_into(whole, part), out.begin() + static_cast<std::ptrdiff_t>(first));
  std::vector<camera::CameraMove> moves;
  for (const camera::CameraMove& move : whole.moves()) {
    if (move.camera < first || move.camera >= first + part.size()) moves.push_back(move);
  }
  add_moves(part, first, moves);
  return camera::Rig(std::move(out), first == 0 ? part.cam_from_rig(0) : whole.cam_from_rig(0)).with_moves(moves);
}

camera::Rig cameras_of(const camera::Rig& whole, std::size_t first, std::size_t size) {
  if (size == whole.size()) return whole;
  std::vector<camera::RigCamera> out = cameras(whole);
  const auto begin = out.begin() + static_cast<std::ptrdiff_t>(first);
  out.erase(begin + static_cast<std::ptrdiff_t>(size), out.end());
  out.erase(out.begin(), begin);
  std::vector<camera::CameraMove> moves;
  for (const camera::CameraMove& move : whole.moves()) {
    if (move.camera >= first && move.camera < first + size)
      moves.push_back({move.camera - first, move.time_ns, move.T_after_initial});
  }
  return camera::Rig(std::move(out), whole.cam_from_rig(first)).with_moves(std::move(moves));
}

}  // namespace bslam::map
