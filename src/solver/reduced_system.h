// The linear system of bundle adjustment after elimination of the points: sparse blocks of the frames, bordered by the
// dense block of the rig,
//     [ S    B ] [x_frames]   [r_frames]
//     [ B^T  C ] [x_rig   ] = [r_rig   ].
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <span>

#include "geometry/so3.h"
#include "matrix/block_matrix.h"
#include "matrix/supernodal_cholesky.h"

namespace bslam::solver {

// A diagonal entry of the normal equations for damping, bounded so that directions without information are damped a
// little.
inline double bounded_diagonal(double entry) { return std::clamp(entry, 1e-6, 1e32); }

class ReducedSystem {
 public:
  using Border = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  enum class Storage { kDense, kSparse };  // storage of the frames' blocks

  // `pattern` must be numbered and outlive the system. `frame_sizes`: unknowns of each frame. `rig_size` may be 0.
  ReducedSystem(const matrix::BlockPattern& pattern, std::span<const int> frame_sizes, int rig_size, Storage storage);

  matrix::BlockMatrix& frames() { return frames_; }  // S
  const matrix::BlockMatrix& frames() const { return frames_; }
  Border& border() { return border_; }     // B: (frame unknowns, rig unknowns)
  Eigen::MatrixXd& rig() { return rig_; }  // C: lower triangle
  Eigen::VectorXd& rhs() { return rhs_; }  // frames, then rig

  // Factorises and solves. Returns false if the matrix is not positive definite to machine precision.
  bool solve(Eigen::VectorXd& delta);
  // Factorises S. Returns false if it is not positive definite to machine precision.
  bool factorise();
  // The blocks of S^-1 of the poses of these frames: their covariances, given the rig. Valid after factorise().
  std::vector<geometry::Matrix6d> pose_covariances(std::span<const int> frames) const;
  // -S^-1 B: how the frames change with the rig's unknowns. Valid after factorise().
  Eigen::MatrixXd rig_sensitivity() const;
  // C - B^T S^-1 B, the information matrix of the rig with the frames marginalised out. Valid after solve().
  const Eigen::MatrixXd& rig_information() const { return rig_information_; }
  // The equations of the rig with the frames marginalised out, (C - B^T S^-1 B) x = r_rig - B^T S^-1 r_frames, which
  // may be singular. Valid after factorise().
  struct RigEquations {
    Eigen::MatrixXd information;
    Eigen::VectorXd rhs;
  };
  RigEquations rig_equations() const;

 private:
  // Whether S is factorised sparsely; without frames it never is.
  bool sparse() const { return storage_ == Storage::kSparse && frames_.rows() > 0; }
  geometry::Matrix6d dense_pose_covariance(int frame) const;
  // S^-1 B for a vector or a matrix. Valid after factorise().
  template <class Matrix>
  Matrix solve_frames(Matrix B) const;

  Storage storage_;
  matrix::BlockMatrix frames_;
  Border border_;
  Eigen::MatrixXd rig_, rig_information_;
  Eigen::VectorXd rhs_;
  Eigen::MatrixXd dense_;
  std::optional<matrix::SupernodalCholesky> sparse_;
};

}  // namespace bslam::solver
