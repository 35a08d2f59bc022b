// Entries of the inverse of a sparse symmetric matrix, at the cost of its factorisation.
#pragma once

#include <Eigen/SparseCore>

namespace bslam::matrix {

// `L`: a compressed lower triangular matrix with positive diagonal, rows ascending in each column, as from a Cholesky
// factorisation. Returns the entries of (L L^T)^-1 where L has entries, as the lower triangle (Takahashi, Fagan, Chin:
// "Formation of a sparse bus impedance matrix", 1973).
Eigen::SparseMatrix<double> selected_inverse(const Eigen::SparseMatrix<double>& L);

}  // namespace bslam::matrix
