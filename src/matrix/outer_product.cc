#include "matrix/outer_product.h"

#include <cstring>

#include "base/vectorised.h"

namespace bslam::matrix {
namespace {

using Vector4 = double __attribute__((vector_size(32)));

// Two columns of S are 12 consecutive numbers, which are three vectors. Both U are column-major.
BSLAM_VECTORISED void subtract(const double* Ua, const double* Ub, double* S) {
  Vector4 a[3][3];  // per column of U_a: the rows 0 to 3, 4 to 1, and 2 to 5
  for (int k = 0; k < 3; ++k) {
    const double* u = Ua + 6 * k;
    a[k][0] = Vector4{u[0], u[1], u[2], u[3]};
    a[k][1] = Vector4{u[4], u[5], u[0], u[1]};
    a[k][2] = Vector4{u[2], u[3], u[4], u[5]};
  }
  for (int j = 0; j < 6; j += 2) {
    Vector4 sum[3];
    for (int k = 0; k < 3; ++k) {
      const double left = Ub[6 * k + j], right = Ub[6 * k + j + 1];
      const Vector4 b[3] = {Vector4{left, left, left, left}, Vector4{left, left, right, right},
                            Vector4{right, right, right, right}};
      for (int v = 0; v < 3; ++v) sum[v] = k == 0 ? a[k][v] * b[v] : sum[v] + a[k][v] * b[v];
    }
    for (int v = 0; v < 3; ++v) {
      Vector4 s;
      std::memcpy(&s, S + 6 * j + 4 * v, sizeof s);
      s -= sum[v];
      std::memcpy(S + 6 * j + 4 * v, &s, sizeof s);
    }
  }
}

}  // namespace

void subtract_outer_product(const Eigen::Matrix<double, 6, 3>& Ua, const Eigen::Matrix<double, 6, 3>& Ub, double* S) {
  subtract(Ua.data(), Ub.data(), S);
}

}  // namespace bslam::matrix
