#include "matrix/supernodal_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <optional>

#include "base/random.h"
#include "matrix/selected_inverse.h"

namespace bslam::matrix {
namespace {

// A matrix such as that of poses along a path with loops: neighbours are connected, and some that are far apart.
class SupernodalCholeskyTest : public testing::Test {
 protected:
  static constexpr int kBlocks = 80, kLoops = 25;

  SupernodalCholeskyTest() {
    for (int b = 0; b < kBlocks; ++b) sizes.push_back(b % 7 == 3 ? 9 : 6);
    for (int b = 0; b < kBlocks; ++b) {
      for (int k = 1; k < 5 && b + k < kBlocks; ++k) connect(b, b + k);
    }
    for (int k = 0; k < kLoops; ++k)
      connect(static_cast<int>(random.below(kBlocks)), static_cast<int>(random.below(kBlocks)));
    pattern.number();
    A.emplace(pattern, sizes);
    fill();
  }

  void connect(int a, int b) { pattern.mark(std::max(a, b), std::min(a, b)); }

  // Random blocks, and a diagonal that makes the matrix positive definite. The upper triangle of diagonal blocks, which
  // must not be read, is not a number.
  void fill() {
    dense = Eigen::MatrixXd::Zero(A->rows(), A->rows());
    for (std::size_t b = 0; b < pattern.positions().size(); ++b) {
      const auto [row, column] = pattern.positions()[b];
      const auto block = A->block(static_cast<int>(b));
      auto* values = const_cast<double*>(block.data());
      for (Eigen::Index c = 0; c < block.cols(); ++c) {
        for (Eigen::Index r = 0; r < block.rows(); ++r) {
          double& value = values[c * block.rows() + r];
          value = row == column && r == c ? 60.0 + random.uniform(0, 9) : random.normal();
          const Eigen::Index i = A->offset(row) + r, j = A->offset(column) + c;
          if (i >= j) dense(i, j) = dense(j, i) = value;
          if (i < j) value = std::numeric_limits<double>::quiet_NaN();
        }
      }
    }
  }

  Random random{1, "supernodal"};
  std::vector<int> sizes;
  BlockPattern pattern{kBlocks};
  std::optional<BlockMatrix> A;
  Eigen::MatrixXd dense;
};

TEST_F(SupernodalCholeskyTest, SolvesLikeADenseFactorisation) {
  SupernodalCholesky factor(pattern, sizes);
  for (int round = 0; round < 2; ++round) {  // the analysis serves for several matrices
    ASSERT_TRUE(factor.factorise(*A));
    const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(A->rows(), 3, [&] { return random.normal(); });
    const Eigen::MatrixXd expected = dense.llt().solve(B);
    EXPECT_LT((factor.solve(B) - expected).norm(), 1e-12 * expected.norm());
    fill();
  }
}

TEST_F(SupernodalCholeskyTest, FactorIsSparseAndThatOfThePermutedMatrix) {
  SupernodalCholesky factor(pattern, sizes);
  ASSERT_TRUE(factor.factorise(*A));
  const Eigen::SparseMatrix<double> L = factor.factor();
  EXPECT_LT(L.nonZeros(), L.rows() * L.rows() / 4);
  const Eigen::MatrixXd product = L * Eigen::MatrixXd(L.transpose());
  for (int a = 0; a < kBlocks; ++a) {
    for (int b = 0; b < kBlocks; ++b) {
      const auto size_a = sizes[static_cast<std::size_t>(a)], size_b = sizes[static_cast<std::size_t>(b)];
      const auto found = product.block(factor.position(a), factor.position(b), size_a, size_b);
      EXPECT_LT((found - dense.block(A->offset(a), A->offset(b), size_a, size_b)).norm(), 1e-10) << a << " " << b;
    }
  }
}

// Columns that are stored together have more rows than their own, but all of them are connected by elimination.
TEST_F(SupernodalCholeskyTest, FactorServesForEntriesOfTheInverse) {
  SupernodalCholesky factor(pattern, sizes);
  ASSERT_TRUE(factor.factorise(*A));
  const Eigen::MatrixXd inverse = dense.inverse();
  const Eigen::SparseMatrix<double> found = selected_inverse(factor.factor());
  std::vector<Eigen::Index> row_of_A(static_cast<std::size_t>(A->rows()));
  for (int b = 0; b < kBlocks; ++b) {
    for (int r = 0; r < sizes[static_cast<std::size_t>(b)]; ++r)
      row_of_A[static_cast<std::size_t>(factor.position(b) + r)] = A->offset(b) + r;
  }
  for (int j = 0; j < found.cols(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(found, j); it; ++it)
      EXPECT_NEAR(it.value(),
                  inverse(row_of_A[static_cast<std::size_t>(it.row())], row_of_A[static_cast<std::size_t>(j)]), 1e-10);
  }
}

TEST(SupernodalCholesky, FactorisesOneBlockAndBlocksThatAreNotConnected) {
  for (const int blocks : {1, 5}) {
    BlockPattern pattern(blocks);
    pattern.number();
    const std::vector<int> sizes(static_cast<std::size_t>(blocks), 6);
    BlockMatrix A(pattern, sizes);
    for (int b = 0; b < blocks; ++b) A.leading<6>(pattern.index(b, b)).diagonal().setConstant(b + 2.0);
    SupernodalCholesky factor(pattern, sizes);
    ASSERT_TRUE(factor.factorise(A));
    const Eigen::MatrixXd X = factor.solve(Eigen::MatrixXd::Ones(6 * blocks, 1));
    for (int b = 0; b < blocks; ++b) EXPECT_NEAR(X(6 * b, 0), 1 / (b + 2.0), 1e-15);
  }
}

TEST_F(SupernodalCholeskyTest, RejectsMatricesThatAreNotPositiveDefinite) {
  SupernodalCholesky factor(pattern, sizes);
  A->leading<6>(pattern.index(kBlocks / 2, kBlocks / 2))(3, 3) = -1.0;
  EXPECT_FALSE(factor.factorise(*A));
}

}  // namespace
}  // namespace bslam::matrix
