#include "matrix/row_update.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace bslam::matrix {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Sizes that are and are not multiples of the width of a vector. Elements beside the updated ones must not change.
TEST(RowUpdate, EqualsTheSumsInOrderOfTheDepth) {
  std::srand(3);
  for (const int rows : {1, 3, 6}) {
    for (const int columns : {1, 2, 6, 8, 11}) {
      const Eigen::MatrixXd A = Eigen::MatrixXd::Random(rows + 1, 3);
      const RowMajor B = 1e3 * RowMajor::Random(3, columns + 2), start = RowMajor::Random(rows + 1, columns + 3);
      const SmallProduct product{A.data(), A.rows(), B.data(), B.cols(), rows, columns};
      RowMajor added = start, subtracted = start;
      add_product_2(product, added.data(), added.cols());
      subtract_product_3(product, subtracted.data(), subtracted.cols());
      for (int r = 0; r < start.rows(); ++r) {
        for (int c = 0; c < start.cols(); ++c) {
          const bool updated = r < rows && c < columns;
          const double two = updated ? A(r, 0) * B(0, c) + A(r, 1) * B(1, c) : 0.0;
          EXPECT_EQ(added(r, c), start(r, c) + two) << r << ", " << c;
          EXPECT_EQ(subtracted(r, c), start(r, c) - (updated ? two + A(r, 2) * B(2, c) : 0.0)) << r << ", " << c;
        }
      }
    }
  }
}

}  // namespace
}  // namespace bslam::matrix
