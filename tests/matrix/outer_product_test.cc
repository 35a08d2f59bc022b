#include "matrix/outer_product.h"

#include <gtest/gtest.h>

namespace bslam::matrix {
namespace {

TEST(OuterProduct, EqualsTheSumsInOrderOfTheColumns) {
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  std::srand(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix63d a = Matrix63d::Random(), b = 1e3 * Matrix63d::Random();
    const Eigen::Matrix<double, 6, 6> start = Eigen::Matrix<double, 6, 6>::Random();
    Eigen::Matrix<double, 6, 6> S = start;
    subtract_outer_product(a, b, S.data());
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column) {
        double sum = a(row, 0) * b(column, 0);
        sum += a(row, 1) * b(column, 1);
        sum += a(row, 2) * b(column, 2);
        EXPECT_EQ(S(row, column), start(row, column) - sum) << row << ", " << column;
      }
    }
  }
}

}  // namespace
}  // namespace bslam::matrix
