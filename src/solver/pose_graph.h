// Pose graph optimisation, which distributes the correction of a loop closure before bundle adjustment: rigid, or with
// a scale per vertex where the scale is not observable (Strasdat, Montiel and Davison, RSS 2010). Equations:
// docs/math.md, section 9.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "geometry/sim3.h"
#include "solver/lm.h"

namespace bslam::solver {

struct PoseGraphProblem {
  struct Edge {
    int a = 0, b = 0;      // two different vertices
    geometry::Sim3 S_a_b;  // measured S_a_world * S_b_world^-1
    double weight = 1;     // positive factor of the information given by the options
  };
  std::vector<geometry::Sim3> S_world;  // per vertex: S_i_world, maps world to keyframe i
  std::vector<std::uint8_t> fixed;      // per vertex
  std::vector<Edge> edges;              // any two vertices may have several
  // False: the scale is observed, every scale is 1 and stays so exactly, 6 unknowns a vertex. True: 7.
  bool scale_free = false;
};

struct PoseGraphOptions {
  int iterations = 20;              // accepted or rejected steps at most
  double relative_decrease = 1e-6;  // of the cost, below which it has converged
  // How far neighbouring keyframes of one map are off relative to each other. Their ratio is what counts: the rotation
  // moves what is seen 4 m away by as much as the translation.
  double sigma_rotation = 0.005;    // rad, per axis
  double sigma_translation = 0.02;  // m, or the map's unit; per axis
  double sigma_log_scale = 0.01;    // where the scale is free

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 1000}, "", "steps at most");
    visitor("relative_decrease", self.relative_decrease, Range{0, 0.1}, "",
            "of the cost, below which it has converged");
    visitor("sigma_rotation", self.sigma_rotation, Range{1e-6, 1}, "rad", "deviation of an edge's rotation, per axis");
    visitor("sigma_translation", self.sigma_translation, Range{1e-6, 100}, "m",
            "deviation of an edge's translation, per axis");
    visitor("sigma_log_scale", self.sigma_log_scale, Range{1e-6, 1}, "", "deviation of an edge's logarithm of scale");
  }
};

// Improves the vertices in place by Levenberg-Marquardt; on LmStop::kFailed the problem is unchanged. The first vertex
// of a connected component without a fixed vertex is held, so a vertex without edges does not move. The cost is half
// the sum of squared normalised errors. A stop request ends it after the current step and keeps the improvement so far.
// Deterministic to the bit.
LmSummary optimise(PoseGraphProblem& problem, const PoseGraphOptions& options, std::stop_token stop = {});

}  // namespace bslam::solver
