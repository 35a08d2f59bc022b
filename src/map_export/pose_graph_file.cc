#include "map_export/pose_graph_file.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <iterator>
#include <set>
#include <vector>

#include "geometry/so3.h"
#include "map/keyframe_landmarks.h"
#include "map_export/landmark_information.h"

namespace bslam::map_export {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

// The landmarks that both keyframes observe, in order of id.
std::vector<LandmarkId> common_landmarks(const map::BundledMap& map, KeyframeId i, KeyframeId j) {
  std::vector<LandmarkId> common;
  std::ranges::set_intersection(map::landmarks_of(map, i), map::landmarks_of(map, j), std::back_inserter(common));
  return common;
}

// Information about T_i_j, in the order and parametrisation of g2o, with keyframe i constant.
Matrix6d relative_information(const Selection& selection, KeyframeId i, KeyframeId j) {
  const map::BundledMap& map = *selection.map;
  const geometry::SE3& T_j_world = map.keyframe(j).T_rig_world;
  const Eigen::Matrix3d R_world_j = T_j_world.matrix3().transpose();
  Matrix6d information = Matrix6d::Zero();
  for (const LandmarkId l : common_landmarks(map, i, j)) {
    const auto [W_i, W_j] = landmark_information(selection, l, i, j);
    // X_j <- X_j exp(t, q) moves the point, in the frame of j, by -t - 2 q x p.
    Matrix36d motion;
    motion.leftCols<3>() = -R_world_j;
    motion.rightCols<3>() = 2.0 * R_world_j * geometry::skew(T_j_world * map.landmark(l).position);
    const Eigen::Matrix3d W = W_i + W_j + 1e-12 * (W_i + W_j).trace() * Eigen::Matrix3d::Identity();
    information += motion.transpose() * (W_j - W_j * W.ldlt().solve(W_j)) * motion;  // without the point
  }
  return 0.5 * (information + information.transpose());
}

bool determines_pose(const Matrix6d& information) {
  constexpr double kMinPivot = 1e-3;
  const Eigen::LDLT<Matrix6d> ldlt(information);
  return ldlt.info() == Eigen::Success && ldlt.isPositive() && ldlt.vectorD().minCoeff() > kMinPivot;
}

std::string pose_text(const geometry::SE3& T) {
  const geometry::Quaterniond& q = T.rotation();
  const geometry::Vector3d& t = T.translation();
  return fmt::format("{} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

// Pairs of keyframes, the smaller id first.
std::set<std::pair<KeyframeId, KeyframeId>> edges_of(const Selection& selection, int min_shared) {
  std::set<std::pair<KeyframeId, KeyframeId>> edges;
  for (const KeyframeId k : selection.keyframes) {
    const map::BundledKeyframe& keyframe = selection.map->keyframe(k);
    if (keyframe.parent.valid() && selection.map->alive(keyframe.parent))
      edges.insert(std::minmax({k, keyframe.parent}));
    for (const map::Covisible& other : keyframe.covisible) {
      if (other.weight >= min_shared && selection.selected[other.keyframe.index()])
        edges.insert(std::minmax({k, other.keyframe}));
    }
  }
  return edges;
}

}  // namespace

PoseGraphFile g2o_text(const Selection& selection, int min_shared) {
  PoseGraphFile file;
  const map::BundledMap& map = *selection.map;
  for (const KeyframeId k : selection.keyframes) {
    file.text += fmt::format("VERTEX_SE3:QUAT {} {}\n", k.value(), pose_text(selection.world_from_rig(k)));
    ++file.vertices;
  }
  file.text += fmt::format("FIX {}\n", selection.keyframes.front().value());
  for (const auto& [i, j] : edges_of(selection, min_shared)) {
    Matrix6d information = relative_information(selection, i, j);
    if (!determines_pose(information)) information += kWeakInformation * Matrix6d::Identity();
    file.text += fmt::format("EDGE_SE3:QUAT {} {} {}", i.value(), j.value(),
                             pose_text(map.keyframe(i).T_rig_world * selection.world_from_rig(j)));
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column)
        fmt::format_to(std::back_inserter(file.text), " {}", information(row, column));
    }
    file.text += '\n';
    ++file.edges;
  }
  return file;
}

}  // namespace bslam::map_export
