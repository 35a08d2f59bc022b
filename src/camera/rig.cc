#include "camera/rig.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/assert.h"

namespace bslam::camera {

using geometry::SE3;

Rig::Rig(std::vector<RigCamera> cameras) : cameras_(std::move(cameras)) {
  BSLAM_ASSERT(!cameras_.empty(), "a rig has at least one camera");
  for (const RigCamera& c : cameras_) {
    T_cam_rig_.push_back(c.T_body_cam.inverse() * cameras_.front().T_body_cam);
    T_rig_cam_.push_back(T_cam_rig_.back().inverse());
  }
  T_cam_rig_.front() = T_rig_cam_.front() = SE3();
  measure_overlap();
}

void Rig::measure_overlap() {
  constexpr int kColumns = 24, kRows = 16;
  constexpr std::array kDepths = {0.5, 2.0, 10.0, 100.0};  // metres, near to far
  overlap_.assign(size() * size(), 0.0);
  for (std::size_t i = 0; i < size(); ++i) {
    std::vector<Vector3d> bearings;
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kColumns; ++c) {
        const Vector2d pixel((c + 0.5) * camera(i).width / kColumns - 0.5, (r + 0.5) * camera(i).height / kRows - 0.5);
        if (const auto bearing = camera(i).unproject(pixel)) bearings.push_back(*bearing);
      }
    }
    for (std::size_t j = 0; j < size(); ++j) {
      if (i == j) continue;
      const SE3 T_j_i = T_cam_rig_[j] * T_rig_cam_[i];
      for (const double depth : kDepths) {
        const auto seen = std::count_if(bearings.begin(), bearings.end(), [&](const Vector3d& b) {
          const auto pixel = camera(j).project(T_j_i * (depth * b));
          return pixel && camera(j).contains(*pixel);
        });
        double& share = overlap_[i * size() + j];
        share = std::max(share, static_cast<double>(seen) / (kColumns * kRows));
      }
    }
  }
}

bool Rig::any_overlap() const {
  for (std::size_t i = 0; i < size(); ++i) {
    for (std::size_t j = 0; j < size(); ++j) {
      if (overlap(i, j)) return true;
    }
  }
  return false;
}

Rig Rig::subset(std::span<const int> indices) const {
  std::vector<RigCamera> chosen;
  for (const int i : indices) {
    BSLAM_ASSERT(i >= 0 && static_cast<std::size_t>(i) < size(), "camera index within the rig");
    chosen.push_back(cameras_[static_cast<std::size_t>(i)]);
  }
  return Rig(std::move(chosen));
}

}  // namespace bslam::camera
