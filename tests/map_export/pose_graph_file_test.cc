#include "map_export/pose_graph_file.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>
#include <sstream>
#include <tuple>

#include "adjustment/bundle_problem.h"
#include "map_export/exported_map.h"

namespace bslam::map_export {
namespace {

using geometry::SE3;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

struct Edge {
  int from = 0, to = 0;
  SE3 T_from_to;
  Matrix6d information;
};

struct Graph {
  std::map<int, SE3> vertices;  // T_world_rig
  std::vector<int> fixed;
  std::vector<Edge> edges;
};

SE3 read_node_pose(std::istream& in) {
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  in >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
  EXPECT_NEAR(q.norm(), 1, 1e-9);
  return {q, t};
}

// A reader of its own, by the conventions of g2o's types slam3d.
Graph parse(const std::string& text) {
  Graph graph;
  std::istringstream in(text);
  for (std::string tag; in >> tag;) {
    int id = 0;
    in >> id;
    if (tag == "VERTEX_SE3:QUAT") {
      graph.vertices[id] = read_node_pose(in);
    } else if (tag == "FIX") {
      graph.fixed.push_back(id);
    } else {
      EXPECT_EQ(tag, "EDGE_SE3:QUAT");
      Edge edge{id, 0, {}, {}};
      in >> edge.to;
      edge.T_from_to = read_node_pose(in);
      for (int row = 0; row < 6; ++row)
        for (int column = row; column < 6; ++column) {
          in >> edge.information(row, column);
          edge.information(column, row) = edge.information(row, column);
        }
      graph.edges.push_back(edge);
    }
    EXPECT_TRUE(in) << tag;
  }
  return graph;
}

// The error of a SE3 edge in g2o: translation and vector part of the quaternion of Z^-1 X_i^-1 X_j.
Eigen::Matrix<double, 6, 1> error_of(const Edge& edge, const SE3& from, const SE3& to) {
  const SE3 delta = edge.T_from_to.inverse() * from.inverse() * to;
  Eigen::Matrix<double, 6, 1> e;
  e << delta.translation(), delta.rotation().vec() * (delta.rotation().w() < 0 ? -1 : 1);
  return e;
}

TEST(PoseGraphFile, IsConnectedAndAtItsOptimum) {
  const ExportedMap map(synthetic::ring_rig(3));
  const PoseGraphFile file = g2o_text(map.selection, 5);
  const Graph graph = parse(file.text);
  ASSERT_EQ(graph.vertices.size(), map.selection.keyframes.size());
  EXPECT_EQ(file.vertices, graph.vertices.size());
  EXPECT_EQ(file.edges, graph.edges.size());
  EXPECT_GT(graph.edges.size(), graph.vertices.size());  // more than the spanning tree
  EXPECT_EQ(graph.fixed, std::vector<int>{map.selection.keyframes.front().value()});
  std::map<int, int> component;
  for (const auto& [id, pose] : graph.vertices) component[id] = id;
  for (const Edge& edge : graph.edges) {
    EXPECT_LT(error_of(edge, graph.vertices.at(edge.from), graph.vertices.at(edge.to)).norm(), 1e-9);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(edge.information).eigenvalues()[0], 0);
    const int old = component.at(edge.to), joined = component.at(edge.from);
    for (auto& [id, c] : component)
      if (c == old) c = joined;
  }
  for (const auto& [id, c] : component) EXPECT_EQ(c, component.begin()->second) << id;
}

// The standard deviations of the keypoints of all keyframes that observe a landmark, as in adjustments.
using Deviations = std::map<std::tuple<LandmarkId, KeyframeId, CameraIndex>, double>;
Deviations deviations(const map::BundledMap& map) {
  const adjustment::BundleProblem problem = adjustment::build_problem(
      map, {.free_keyframes = map.keyframe_ids(), .fixed_keyframes = {}, .landmarks = map.landmark_ids()},
      {.pyramid = map.pyramid()});
  Deviations out;
  for (std::size_t i = 0; i < problem.sources.size(); ++i) {
    const auto& observation = problem.problem.observations[i];
    out[{problem.sources[i].landmark, problem.sources[i].keyframe, observation.camera}] = observation.sigma;
  }
  return out;
}

// The sum of squares of the reprojection errors of one landmark in two keyframes, about its minimum: the second
// keyframe is moved by g2o's increment `d`, and the landmark by `m`. Residuals are linearised by differences.
Matrix6d numerical_information(const map::BundledMap& map, KeyframeId i, KeyframeId j) {
  Matrix6d sum = Matrix6d::Zero();
  const SE3 T_world_j = map.keyframe(j).T_rig_world.inverse();
  const Deviations sigmas = deviations(map);
  for (const LandmarkId l : map.landmark_ids()) {
    if (map.observations(l).size() < 2) continue;  // not in both keyframes
    std::vector<Eigen::Matrix<double, 2, 9>> rows;
    bool in_i = false, in_j = false;
    for (const map::Observation& o : map.observations(l)) {
      if (o.keyframe != i && o.keyframe != j) continue;
      (o.keyframe == i ? in_i : in_j) = true;
      for (const frame::KeypointRef r : map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature)) {
        const SE3 T_cam_rig = map.rig().cam_from_rig(r.camera);
        const double sigma = sigmas.at({l, o.keyframe, r.camera});
        const auto pixel = [&](const Eigen::Matrix<double, 9, 1>& d) {
          const Eigen::Vector3d q = d.segment<3>(3);
          const SE3 step(Eigen::Quaterniond(std::sqrt(1 - q.squaredNorm()), q.x(), q.y(), q.z()), d.head<3>());
          const SE3 T_rig_world = o.keyframe == j ? (T_world_j * step).inverse() : map.keyframe(o.keyframe).T_rig_world;
          return map.rig().camera(r.camera).project(T_cam_rig * T_rig_world * (map.landmark(l).position + d.tail<3>()));
        };
        Eigen::Matrix<double, 2, 9> J;
        for (int c = 0; c < 9; ++c) {
          Eigen::Matrix<double, 9, 1> d = Eigen::Matrix<double, 9, 1>::Zero();
          d[c] = 1e-5;
          const auto plus = pixel(d), minus = pixel(-d);
          if (!plus || !minus) return Matrix6d::Constant(NAN);
          J.col(c) = (*plus - *minus) / 2e-5 / sigma;
        }
        rows.push_back(J);
      }
    }
    if (!in_i || !in_j) continue;
    Eigen::Matrix<double, 9, 9> H = Eigen::Matrix<double, 9, 9>::Zero();
    for (const auto& J : rows) H += J.transpose() * J;
    sum += H.topLeftCorner<6, 6>() -
           H.topRightCorner<6, 3>() * H.bottomRightCorner<3, 3>().inverse() * H.bottomLeftCorner<3, 6>();
  }
  return sum;
}

TEST(PoseGraphFile, InformationIsThatOfTheSharedLandmarks) {
  const ExportedMap map(synthetic::ring_rig(3));
  const Graph graph = parse(g2o_text(map.selection, 20).text);
  int compared = 0;
  for (const Edge& edge : graph.edges) {
    if (++compared > 3) break;
    const Matrix6d expected = numerical_information(map.map, KeyframeId(edge.from), KeyframeId(edge.to));
    ASSERT_TRUE(expected.allFinite());
    EXPECT_LT((edge.information - expected).norm(), 1e-4 * expected.norm());
  }
  EXPECT_GT(compared, 2);
}

}  // namespace
}  // namespace bslam::map_export
