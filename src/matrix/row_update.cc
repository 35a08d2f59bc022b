#include "matrix/row_update.h"

#include "base/vectorised.h"

namespace bslam::matrix {
namespace {

BSLAM_VECTORISED void add_2(const SmallProduct& p, double* C, std::ptrdiff_t C_row_stride) {
  const double *b0 = p.B, *b1 = p.B + p.B_row_stride;
  for (int r = 0; r < p.rows; ++r) {
    const double a0 = p.A[r], a1 = p.A[r + p.A_column_stride];
    double* __restrict c = C + r * C_row_stride;
    for (int k = 0; k < p.columns; ++k) c[k] += a0 * b0[k] + a1 * b1[k];
  }
}

BSLAM_VECTORISED void subtract_3(const SmallProduct& p, double* C, std::ptrdiff_t C_row_stride) {
  const double *b0 = p.B, *b1 = p.B + p.B_row_stride, *b2 = p.B + 2 * p.B_row_stride;
  for (int r = 0; r < p.rows; ++r) {
    const double a0 = p.A[r], a1 = p.A[r + p.A_column_stride], a2 = p.A[r + 2 * p.A_column_stride];
    double* __restrict c = C + r * C_row_stride;
    for (int k = 0; k < p.columns; ++k) c[k] -= a0 * b0[k] + a1 * b1[k] + a2 * b2[k];
  }
}

}  // namespace

void add_product_2(const SmallProduct& product, double* C, std::ptrdiff_t C_row_stride) {
  add_2(product, C, C_row_stride);
}

void subtract_product_3(const SmallProduct& product, double* C, std::ptrdiff_t C_row_stride) {
  subtract_3(product, C, C_row_stride);
}

}  // namespace bslam::matrix
