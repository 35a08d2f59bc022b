// The observations of a ReprojectionProblem that are used in an adjustment, sorted for its loops: by point, and
// within a point by pose.
#pragma once

#include <span>
#include <vector>

#include "matrix/block_pattern.h"
#include "solver/bundle_adjuster.h"

namespace bslam::solver {

struct BundleStructure {
  struct Term {  // one observation
    Eigen::Vector2f pixel;
    float inverse_sigma;  // 1 / px
    int camera;
  };
  struct Group {  // observations of one point by all cameras of one pose
    int pose = 0;
    int slot = -1;  // index of a free pose in the reduced camera system; -1: the pose is fixed
    std::size_t first_term = 0;
  };
  struct Point {
    int point = 0;  // index in the problem
    std::size_t first_group = 0;
    std::size_t first_pair = 0;  // index in pair_block
  };

  std::vector<Term> terms;
  std::vector<Group> groups;  // with a sentinel at the end
  std::vector<Point> points;  // with a sentinel at the end
  std::vector<int> pose_of_slot;
  std::vector<int> frame_sizes;  // per slot: number of unknowns of the frame, beginning with the six of the pose
  matrix::BlockPattern pattern{0};
  // Block number of each pair of free groups (a, b), b <= a, of each point, in the order of a, then b.
  std::vector<int> pair_block;

  std::size_t num_points() const { return points.size() - 1; }
  std::span<const Term> terms_of(std::size_t point) const {
    const std::size_t begin = groups[points[point].first_group].first_term;
    return {terms.data() + begin, groups[points[point + 1].first_group].first_term - begin};
  }
};

// Ignores the observations flagged in `skip`, those whose squared normalised error in `chi2` is not below kMaxChi2,
// points with fewer than two remaining observations, which contain no information about a pose, and free poses without
// observations.
BundleStructure make_structure(const ReprojectionProblem& problem, const std::vector<double>& chi2,
                               std::span<const std::uint8_t> skip);

}  // namespace bslam::solver
