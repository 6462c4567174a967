/// Shapes of the 18-state filter: dp, dv, alpha, db_a, db_g, db_m.
#pragma once

#include "EigenCore.h"

namespace strix {

using Vector18f = Eigen::Matrix<float, 18, 1>;
using Matrix18f = Eigen::Matrix<float, 18, 18>;

}  // namespace strix
