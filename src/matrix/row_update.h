// Updates of a few rows of a matrix by a product of small matrices, the inner loops of the rig's normal equations.
#pragma once

#include <cstddef>

namespace bslam::matrix {

// A (rows, depth), column by column, and B (depth, columns), row by row; the strides are numbers of elements.
struct SmallProduct {
  const double* A;
  std::ptrdiff_t A_column_stride;
  const double* B;
  std::ptrdiff_t B_row_stride;
  int rows, columns;
};

// C += A B or C -= A B. C (rows, columns) is stored row by row. The depth is that of the name.
void add_product_2(const SmallProduct& product, double* C, std::ptrdiff_t C_row_stride);
void subtract_product_3(const SmallProduct& product, double* C, std::ptrdiff_t C_row_stride);

}  // namespace bslam::matrix
