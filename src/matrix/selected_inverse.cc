#include "matrix/selected_inverse.h"

#include <vector>

namespace bslam::matrix {

// For Z = (L L^T)^-1, the equation L^T Z = L^-1, whose right-hand side is lower triangular, gives column j from the
// columns behind it:
//     Z_ij = -1 / L_jj sum over k > j of L_kj Z_ik   for i > j,   Z_jj = 1 / L_jj (1 / L_jj - sum of L_kj Z_kj).
// All Z_ik that are needed have an entry in L: i and k both have one in column j, so that eliminating j fills (i, k).
Eigen::SparseMatrix<double> selected_inverse(const Eigen::SparseMatrix<double>& L) {
  Eigen::SparseMatrix<double> Z = L;
  const int* begin = L.outerIndexPtr();
  const int* row = L.innerIndexPtr();
  const double* l = L.valuePtr();
  double* z = Z.valuePtr();
  std::vector<double> l_column(static_cast<std::size_t>(L.rows()), 0.0), sum(l_column);
  const auto at = [row](std::vector<double>& dense, int entry) -> double& {
    return dense[static_cast<std::size_t>(row[entry])];
  };
  for (int j = static_cast<int>(L.cols()) - 1; j >= 0; --j) {
    const int first = begin[j], end = begin[j + 1];
    for (int e = first + 1; e < end; ++e) at(l_column, e) = l[e];
    for (int e = first + 1; e < end; ++e) {
      const int k = row[e];
      // Column k holds Z_ik for i >= k; by symmetry each entry counts for row i and for row k. Entries outside of
      // column j of L meet a zero.
      double of_k = z[begin[k]] * l[e];
      for (int f = begin[k] + 1; f < begin[k + 1]; ++f) {
        at(sum, f) += z[f] * l[e];
        of_k += z[f] * at(l_column, f);
      }
      at(sum, e) += of_k;
    }
    double of_diagonal = 0;
    for (int e = first + 1; e < end; ++e) {
      z[e] = -at(sum, e) / l[first];
      of_diagonal += l[e] * z[e];
    }
    z[first] = (1.0 / l[first] - of_diagonal) / l[first];
    for (int e = first + 1; e < end; ++e) {
      for (int f = begin[row[e]]; f < begin[row[e] + 1]; ++f) at(sum, f) = 0.0;
      at(l_column, e) = 0.0;
    }
  }
  return Z;
}

}  // namespace bslam::matrix
