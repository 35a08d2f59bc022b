#include "matrix/selected_inverse.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include "base/random.h"

namespace bslam::matrix {
namespace {

TEST(SelectedInverse, IsTheInverseWhereTheFactorHasEntries) {
  constexpr int kSize = 60;
  Random random(1, "selected inverse");
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kSize, kSize);
  for (int i = 0; i < 150; ++i) {  // sums of small cliques, as poses that share points
    Eigen::VectorXd v = Eigen::VectorXd::Zero(kSize);
    for (int k = 0; k < 3; ++k) v(static_cast<int>(random.uniform(0, kSize))) = random.normal();
    A += v * v.transpose();
  }
  A.diagonal().array() += 0.1;
  const Eigen::SparseMatrix<double> sparse = A.sparseView();
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(sparse);
  const Eigen::SparseMatrix<double> L = factor.matrixL();
  ASSERT_LT(L.nonZeros(), kSize * (kSize + 1) / 2);
  const Eigen::MatrixXd inverse = A.inverse();
  const Eigen::SparseMatrix<double> found = selected_inverse(L);
  ASSERT_EQ(found.nonZeros(), L.nonZeros());
  for (int j = 0; j < kSize; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(found, j); it; ++it)
      EXPECT_NEAR(it.value(), inverse(it.row(), j), 1e-10 * inverse.norm()) << it.row() << " " << j;
  }
}

}  // namespace
}  // namespace bslam::matrix
