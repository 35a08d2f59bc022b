#include "looping/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "base/disjoint_sets.h"
#include "matrix/block_matrix.h"

namespace bslam::looping {
namespace {

using geometry::Matrix3d;
using geometry::Sim3;
using geometry::Vector3d;
using geometry::Vector7d;
using Edge = PoseGraphProblem::Edge;
using Poses = std::vector<Sim3>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Flags the constant vertices: the fixed ones, and the first vertex of every connected component without any.
std::vector<std::uint8_t> held_vertices(const PoseGraphProblem& problem) {
  const std::size_t vertices = problem.S_world.size();
  DisjointSets components(vertices);
  for (const Edge& edge : problem.edges) components.join(at(edge.a), at(edge.b));
  std::vector<std::uint8_t> held = problem.fixed, anchored(vertices, 0);
  for (std::size_t v = 0; v < vertices; ++v) anchored[components.root(v)] |= problem.fixed[v] != 0;
  for (std::size_t v = 0; v < vertices; ++v) held[v] |= components.root(v) == v && anchored[v] == 0;
  return held;
}

// Block column of each vertex in the order of elimination (approximate minimum degree on vertices, which are a sixth or
// seventh of the unknowns); -1 if it is constant.
std::vector<int> elimination_order(const PoseGraphProblem& problem) {
  const std::vector<std::uint8_t> held = held_vertices(problem);
  std::vector<int> column(held.size(), -1);
  int count = 0;
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (held[v] == 0) column[v] = count++;
  }
  std::vector<Eigen::Triplet<double>> links;
  for (int c = 0; c < count; ++c) links.emplace_back(c, c, 1.0);
  for (const Edge& edge : problem.edges) {
    const int a = column[at(edge.a)], b = column[at(edge.b)];
    if (a < 0 || b < 0) continue;
    links.emplace_back(a, b, 1.0);
    links.emplace_back(b, a, 1.0);
  }
  Eigen::SparseMatrix<double> graph(count, count);
  graph.setFromTriplets(links.begin(), links.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;  // new index -> old index
  Eigen::AMDOrdering<int>()(graph, order);
  std::vector<int> position(at(count));
  for (int k = 0; k < count; ++k) position[at(order.indices()(k))] = k;
  for (int& c : column) c = c < 0 ? -1 : position[at(c)];
  return column;
}

matrix::BlockPattern pattern_of(const PoseGraphProblem& problem, const std::vector<int>& column) {
  const auto count = std::count_if(column.begin(), column.end(), [](int c) { return c >= 0; });
  matrix::BlockPattern pattern(static_cast<int>(count));
  for (int c = 0; c < pattern.size(); ++c) pattern.mark(c, c);
  for (const Edge& edge : problem.edges) {
    const auto [low, high] = std::minmax({column[at(edge.a)], column[at(edge.b)]});
    if (low >= 0) pattern.mark(high, low);
  }
  pattern.number();
  return pattern;
}

// The normal equations H delta = b in blocks of N unknowns per vertex: rotation, translation and, if N is 7, log
// scale.
template <int N>
class PoseGraphEquations {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  // `problem` must outlive the equations and contains the initial values.
  PoseGraphEquations(const PoseGraphProblem& problem, const PoseGraphOptions& options)
      : problem_(problem),
        S_world_(problem.S_world),
        trial_(problem.S_world),
        column_(elimination_order(problem)),
        pattern_(pattern_of(problem, column_)),
        H_(pattern_, std::vector<int>(at(pattern_.size()), N)),
        rhs_(N * pattern_.size()),
        sparse_(H_.sparse_structure()) {
    inverse_sigma_.template head<3>().setConstant(1.0 / options.sigma_rotation);
    inverse_sigma_.template segment<3>(3).setConstant(1.0 / options.sigma_translation);
    if constexpr (N == 7) inverse_sigma_(6) = 1.0 / options.sigma_log_scale;
    S_b_a_.reserve(problem.edges.size());
    for (const Edge& edge : problem.edges) S_b_a_.push_back(edge.S_a_b.inverse());
    factor_.analyzePattern(sparse_);
  }

  double trial_cost() const {
    double sum = 0.0;
    for (std::size_t k = 0; k < S_b_a_.size(); ++k) sum += 0.5 * evaluate(k, trial_).error.squaredNorm();
    return sum;
  }

  double linearise() {
    H_.set_zero();
    rhs_.setZero();
    double sum = 0.0;
    for (std::size_t k = 0; k < S_b_a_.size(); ++k) {
      const Residual r = evaluate(k, S_world_);
      sum += 0.5 * r.error.squaredNorm();
      add(k, r);
    }
    return sum;
  }

  std::optional<double> solve(double damping) {
    if (rhs_.size() == 0) return 0.0;  // all vertices are constant
    H_.copy_to(sparse_);
    const Eigen::VectorXd diagonal = sparse_.diagonal();
    sparse_.diagonal() = (1.0 + damping) * diagonal;
    factor_.factorize(sparse_);
    if (factor_.info() != Eigen::Success) return std::nullopt;
    const Eigen::VectorXd delta = factor_.solve(rhs_);
    if (!delta.allFinite()) return std::nullopt;
    for (std::size_t v = 0; v < S_world_.size(); ++v) {
      Vector7d step = Vector7d::Zero();
      if (column_[v] >= 0) step.head<N>() = delta.segment<N>(N * column_[v]);
      trial_[v] = column_[v] >= 0 ? S_world_[v].perturbed(step) : S_world_[v];
    }
    return 0.5 * (delta.dot(rhs_) + damping * delta.cwiseAbs2().dot(diagonal));
  }

  void accept() { std::swap(S_world_, trial_); }
  Poses& S_world() { return S_world_; }

 private:
  struct Residual {
    Vector error;    // normalised
    Sim3 S_b_b;      // S_b_a(measured) S_a_world S_world_b: the identity if the error is zero
    Vector weights;  // 1 / sigma of each component
  };

  Residual evaluate(std::size_t k, const Poses& S_world) const {
    const Edge& edge = problem_.edges[k];
    Residual out;
    out.S_b_b = S_b_a_[k] * (S_world[at(edge.a)] * S_world[at(edge.b)].inverse());
    out.error.template head<3>() = geometry::so3_log(out.S_b_b.rotation());
    out.error.template segment<3>(3) = out.S_b_b.translation();
    if constexpr (N == 7) out.error(6) = std::log(out.S_b_b.scale());
    out.weights = std::sqrt(edge.weight) * inverse_sigma_;
    out.error = out.error.cwiseProduct(out.weights).eval();
    return out;
  }

  // Adds the residual with its Jacobians: docs/math.md, section 9.
  void add(std::size_t k, const Residual& r) {
    const Edge& edge = problem_.edges[k];
    const Sim3& M = S_b_a_[k];
    const Matrix3d J_log = geometry::so3_left_jacobian_inverse(geometry::so3_log(r.S_b_b.rotation()));
    const Matrix3d R_m = M.rotation().toRotationMatrix(), R_e = r.S_b_b.rotation().toRotationMatrix();
    const Vector3d between = M.translation() - r.S_b_b.translation();
    Matrix J_a = Matrix::Zero(), J_b = Matrix::Zero();
    J_a.template block<3, 3>(0, 0) = J_log * R_m;
    J_a.template block<3, 3>(3, 0) = geometry::skew(between) * R_m;
    J_a.template block<3, 3>(3, 3) = M.scale() * R_m;
    J_b.template block<3, 3>(0, 0) = -J_log * R_e;
    J_b.template block<3, 3>(3, 3) = -r.S_b_b.scale() * R_e;
    if constexpr (N == 7) {
      J_a.template block<3, 1>(3, 6) = -between;
      J_a(6, 6) = 1.0;
      J_b(6, 6) = -1.0;
    }
    J_a = (r.weights.asDiagonal() * J_a).eval();
    J_b = (r.weights.asDiagonal() * J_b).eval();
    const int a = column_[at(edge.a)], b = column_[at(edge.b)];
    if (a >= 0) add_vertex(a, J_a, r.error);
    if (b >= 0) add_vertex(b, J_b, r.error);
    if (a < 0 || b < 0) return;
    if (a > b) {
      H_.leading<N>(pattern_.index(a, b)).noalias() += J_a.transpose() * J_b;
    } else {
      H_.leading<N>(pattern_.index(b, a)).noalias() += J_b.transpose() * J_a;
    }
  }

  void add_vertex(int column, const Matrix& J, const Vector& error) {
    H_.leading<N>(pattern_.index(column, column)).noalias() += J.transpose() * J;
    rhs_.template segment<N>(N * column).noalias() -= J.transpose() * error;
  }

  const PoseGraphProblem& problem_;
  Poses S_world_, trial_;
  std::vector<int> column_;  // per vertex, -1: constant
  matrix::BlockPattern pattern_;
  matrix::BlockMatrix H_;
  Eigen::VectorXd rhs_;
  Vector inverse_sigma_;
  std::vector<Sim3> S_b_a_;  // per edge, the measurement's inverse
  Eigen::SparseMatrix<double> sparse_;
  // Eliminates in the order of the blocks. Uses Eigen's MPL-2 code only.
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor_;
};

// Gauss-Newton with damping after a failed step. Writes the result to the problem on success.
template <int N>
solver::LmSummary optimise_with(PoseGraphProblem& problem, const PoseGraphOptions& options,
                                const std::stop_token& stop) {
  PoseGraphEquations<N> equations(problem, options);
  const solver::LmSummary summary = solver::minimise(equations,
                                                     {.iterations = options.iterations,
                                                      .relative_decrease = options.relative_decrease,
                                                      .rule = solver::DampingRule::kOnFailure},
                                                     stop);
  if (summary.usable()) problem.S_world = std::move(equations.S_world());
  return summary;
}

void check(const PoseGraphProblem& problem) {
  const auto count = static_cast<int>(problem.S_world.size());
  BSLAM_ASSERT(problem.fixed.size() == problem.S_world.size(), "fixed must have one entry per vertex");
  const auto rigid = [](const Sim3& S) { return !(S.scale() < 1.0) && !(S.scale() > 1.0); };
  for (const Edge& edge : problem.edges) {
    BSLAM_ASSERT(edge.a >= 0 && edge.a < count && edge.b >= 0 && edge.b < count,
                 "an edge must refer to vertices of the graph");
    BSLAM_ASSERT(edge.a != edge.b && edge.weight > 0, "an edge must have two different vertices and a positive weight");
    BSLAM_ASSERT(problem.free_scale || rigid(edge.S_a_b), "measured scales must be 1 unless the scale is free");
  }
  for (const Sim3& S : problem.S_world)
    BSLAM_ASSERT(problem.free_scale || rigid(S), "scales must be 1 unless the scale is free");
}

}  // namespace

solver::LmSummary optimise(PoseGraphProblem& problem, const PoseGraphOptions& options, std::stop_token stop) {
  check(problem);
  return problem.free_scale ? optimise_with<7>(problem, options, stop) : optimise_with<6>(problem, options, stop);
}

}  // namespace bslam::looping
