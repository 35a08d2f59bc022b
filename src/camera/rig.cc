#include "camera/rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/assert.h"
#include "camera/model_parameters.h"
#include "camera/view_overlap.h"

namespace bslam::camera {

using geometry::SE3;

const Shutter Rig::kGlobalShutter;

namespace {

// See Rig::min_axis_cosine.
double min_axis_cosine_of(const Camera& camera) {
  constexpr int kSteps = 4;        // tested pixels of each side of the image
  constexpr double kMargin = 0.1;  // rad, for pixels between them, and for the motion during a rolling shutter
  double largest = 0;              // rad
  const double right = camera.width - 1, bottom = camera.height - 1;
  for (int k = 0; k <= kSteps; ++k) {
    const double x = right * k / kSteps, y = bottom * k / kSteps;
    for (const Vector2d& pixel : {Vector2d(x, 0), Vector2d(x, bottom), Vector2d(0, y), Vector2d(right, y)}) {
      const auto ray = camera.unproject(pixel);
      if (!ray) return -1;
      largest = std::max(largest, std::atan2(ray->head<2>().norm(), ray->z()));
    }
  }
  return largest + kMargin < std::numbers::pi ? std::cos(largest + kMargin) : -1;
}

}  // namespace

Rig::Rig(std::vector<RigCamera> cameras, const SE3& T_cam0_rig) {
  BSLAM_ASSERT(!cameras.empty(), "a rig must have at least one camera");
  for (const RigCamera& c : cameras) {
    T_cam_rig_.push_back(c.T_body_cam.inverse() * cameras.front().T_body_cam * T_cam0_rig);
    T_rig_cam_.push_back(T_cam_rig_.back().inverse());
  }
  T_cam_rig_.front() = T_cam0_rig;
  T_rig_cam_.front() = T_cam0_rig.inverse();
  Calibration calibration{{}, measured_overlap(cameras), {}};
  for (const RigCamera& c : cameras) calibration.min_axis_cosine.push_back(min_axis_cosine_of(c.camera));
  calibration.cameras = std::move(cameras);
  calibration_ = std::make_shared<const Calibration>(std::move(calibration));
}

std::vector<double> Rig::measured_overlap(const std::vector<RigCamera>& cameras) const {
  std::vector<SampledView> views;
  for (const RigCamera& c : cameras) views.emplace_back(c.camera, UsedView::all_of(c.camera));
  std::vector<double> overlap(size() * size(), 0.0);
  for (std::size_t i = 0; i < size(); ++i) {
    for (std::size_t j = 0; j < size(); ++j) {
      if (i == j) continue;
      overlap[i * size() + j] = camera::overlap_share(views[i], views[j], T_cam_rig_[j] * T_rig_cam_[i]);
    }
  }
  return overlap;
}

bool Rig::any_overlap(std::span<const std::uint8_t> ignored) const {
  const auto counts = [&](std::size_t i) { return ignored.empty() || !ignored[i]; };
  for (std::size_t i = 0; i < size(); ++i) {
    for (std::size_t j = 0; j < size(); ++j) {
      if (counts(i) && counts(j) && overlap(i, j)) return true;
    }
  }
  return false;
}

Rig Rig::subset(std::span<const int> indices) const {
  int next = 0;
  const bool in_order = std::ranges::all_of(indices, [&](int i) { return i == next++; });
  if (in_order && indices.size() == size()) return *this;
  std::vector<RigCamera> chosen;
  for (const int i : indices) {
    BSLAM_ASSERT(i >= 0 && static_cast<std::size_t>(i) < size(), "the camera index must be within the rig");
    chosen.push_back(calibration_->cameras[static_cast<std::size_t>(i)]);
  }
  std::vector<CameraMove> chosen_moves;
  for (const CameraMove& move : moves()) {
    const auto found = std::ranges::find(indices, static_cast<int>(move.camera));
    if (found != indices.end())
      chosen_moves.push_back({static_cast<std::size_t>(found - indices.begin()), move.time_ns, move.T_after_initial});
  }
  return Rig(std::move(chosen), indices.front() == 0 ? cam_from_rig(0) : SE3()).with_moves(std::move(chosen_moves));
}

Rig Rig::with_moves(std::vector<CameraMove> moves) const {
  std::ranges::stable_sort(moves, {}, &CameraMove::time_ns);
  Rig out = *this;
  out.moves_ = moves.empty() ? nullptr : std::make_shared<const std::vector<CameraMove>>(std::move(moves));
  return out;
}

const CameraMove* Rig::move_at(std::size_t i, TimeNs time_ns) const {
  const CameraMove* last = nullptr;
  for (const CameraMove& move : moves()) {
    if (move.camera == i && move.time_ns <= time_ns) last = &move;
  }
  return last;
}

SE3 Rig::cam_from_rig_at(std::size_t i, TimeNs time_ns) const {
  const CameraMove* move = move_at(i, time_ns);
  return move == nullptr ? cam_from_rig(i) : move->T_after_initial * cam_from_rig(i);
}

Rig Rig::at(TimeNs time_ns) const {
  Rig out = *this;
  out.moves_ = nullptr;
  for (std::size_t i = 0; i < size() && moves_; ++i) {
    out.T_cam_rig_[i] = cam_from_rig_at(i, time_ns);
    out.T_rig_cam_[i] = out.T_cam_rig_[i].inverse();
  }
  return out;
}

Rig Rig::after_moves() const {
  if (!moves_) return *this;
  const Rig last = at(std::numeric_limits<TimeNs>::max());
  std::vector<RigCamera> cameras;
  for (std::size_t i = 0; i < size(); ++i) cameras.push_back({camera(i), body_from_rig() * last.rig_from_cam(i)});
  // The rig frame keeps its axes; its origin is camera 0.
  return Rig(std::move(cameras), SE3(last.cam_from_rig(0).rotation(), Vector3d::Zero()));
}

Rig Rig::with_calibration_of(const Rig& part, std::span<const int> indices) const {
  BSLAM_ASSERT(part.size() == indices.size(), "there must be one index per camera of `part`");
  std::vector<RigCamera> cameras = calibration_->cameras;
  for (std::size_t i = 0; i < part.size(); ++i) {
    RigCamera& camera = cameras[static_cast<std::size_t>(indices[i])];
    camera.camera.model = part.camera(i).model;
    camera.camera.readout_s = part.camera(i).readout_s;
    camera.camera.time_offset_ns = part.camera(i).time_offset_ns;
    camera.T_body_cam = part.body_from_cam(i);
  }
  std::vector<CameraMove> all_moves;  // those of the other cameras, then those of the part
  for (const CameraMove& move : moves()) {
    if (std::ranges::find(indices, static_cast<int>(move.camera)) == indices.end()) all_moves.push_back(move);
  }
  for (const CameraMove& move : part.moves())
    all_moves.push_back({static_cast<std::size_t>(indices[move.camera]), move.time_ns, move.T_after_initial});
  const bool same_first = !indices.empty() && indices.front() == 0;
  return Rig(std::move(cameras), same_first ? part.cam_from_rig(0) : cam_from_rig(0)).with_moves(std::move(all_moves));
}

bool Rig::same_intrinsics(const Rig& other) const {
  BSLAM_ASSERT(size() == other.size(), "rigs with other cameras cannot be compared");
  if (calibration_ == other.calibration_) return true;
  for (std::size_t i = 0; i < size(); ++i) {
    const CameraModel &a = camera(i).model, &b = other.camera(i).model;
    if (a.index() != b.index() || parameters(a) != parameters(b)) return false;
  }
  return true;
}

bool Rig::same_calibration(const Rig& other) const {
  if (!same_intrinsics(other)) return false;
  for (std::size_t i = 0; i < size(); ++i) {
    if (body_from_cam(i).matrix() != other.body_from_cam(i).matrix()) return false;
    const Camera &a = camera(i), &b = other.camera(i);
    if (a.time_offset_ns != b.time_offset_ns || a.readout_s != b.readout_s) return false;
  }
  return std::ranges::equal(moves(), other.moves(), [](const CameraMove& a, const CameraMove& b) {
    return a.camera == b.camera && a.time_ns == b.time_ns && a.T_after_initial.matrix() == b.T_after_initial.matrix();
  });
}

Rig Rig::moving(std::span<const double> delay_s, const geometry::Vector6d& twist) const {
  BSLAM_ASSERT(delay_s.size() == size(), "there must be one delay per camera");
  Rig out = *this;
  for (std::size_t i = 0; i < size(); ++i) {
    if (delay_s[i] == 0.0) continue;
    out.T_cam_rig_[i] = T_cam_rig_[i] * SE3::exp(delay_s[i] * twist);
    out.T_rig_cam_[i] = out.T_cam_rig_[i].inverse();
  }
  const bool rolling =
      std::ranges::any_of(calibration_->cameras, [](const RigCamera& c) { return c.camera.readout_s != 0; });
  for (std::size_t i = 0; rolling && i < size(); ++i) out.shutters_.emplace_back(camera(i), out.T_cam_rig_[i], twist);
  return out;
}

}  // namespace bslam::camera
