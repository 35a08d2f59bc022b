// The products that eliminating a point subtracts from the reduced system (docs/math.md, section 5).
#pragma once

#include <Eigen/Core>

namespace bslam::matrix {

// S -= U_a U_b^T for a column-major (6, 6) block S whose columns are contiguous.
void subtract_outer_product(const Eigen::Matrix<double, 6, 3>& Ua, const Eigen::Matrix<double, 6, 3>& Ub, double* S);

}  // namespace bslam::matrix
