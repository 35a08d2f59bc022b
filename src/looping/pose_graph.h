// Pose graph optimisation, which distributes the correction of a loop closure before bundle adjustment: with rigid
// poses, or with a scale per vertex if the scale is not observable (Strasdat, Montiel and Davison, RSS 2010).
// Equations: docs/math.md, section 9.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "geometry/sim3.h"
#include "solver/lm.h"

namespace bslam::looping {

struct PoseGraphProblem {
  struct Edge {
    int a = 0, b = 0;      // two different vertices
    geometry::Sim3 S_a_b;  // measured S_a_world * S_b_world^-1
    double weight = 1;     // positive factor of the information given by the options
  };
  std::vector<geometry::Sim3> S_world;  // per vertex: S_i_world, maps world to keyframe i
  std::vector<std::uint8_t> fixed;      // per vertex
  std::vector<Edge> edges;              // there may be several edges between two vertices
  // False: all scales must be 1 and are constant; 6 unknowns per vertex. True: 7 unknowns per vertex.
  bool free_scale = false;
};

struct PoseGraphOptions {
  int iterations = 20;              // maximum number of steps, accepted or rejected
  double relative_decrease = 1e-6;  // converged if a step decreases the cost by a smaller fraction
  // Standard deviations of the relative pose of an edge. Only their ratios matter: the default for the rotation moves a
  // point at a distance of 4 m by as much as the default for the translation.
  double sigma_rotation = 0.005;    // rad, per axis
  double sigma_translation = 0.02;  // m, or the map's unit; per axis
  double sigma_log_scale = 0.01;    // if the scale is free

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 1000}, "", "maximum number of steps");
    visitor("relative_decrease", self.relative_decrease, Range{0, 0.1}, "",
            "converged if a step decreases the cost by a smaller fraction");
    visitor("sigma_rotation", self.sigma_rotation, Range{1e-6, 1}, "rad",
            "standard deviation of an edge's rotation, per axis");
    visitor("sigma_translation", self.sigma_translation, Range{1e-6, 100}, "m",
            "standard deviation of an edge's translation, per axis");
    visitor("sigma_log_scale", self.sigma_log_scale, Range{1e-6, 1}, "", "standard deviation of an edge's log scale");
  }
};

// Optimises the vertices in place by Levenberg-Marquardt; on solver::LmStop::kFailed the problem is unchanged. In a
// connected component without a fixed vertex the first vertex is fixed. The cost is half the sum of squared normalised
// errors. A stop request ends the optimisation after the current step and keeps the improvement so far. Bitwise
// deterministic.
solver::LmSummary optimise(PoseGraphProblem& problem, const PoseGraphOptions& options, std::stop_token stop = {});

}  // namespace bslam::looping
