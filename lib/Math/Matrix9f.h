/// Shapes of the 9-state filter: dp, dv, alpha.
#pragma once

#include "EigenCore.h"

namespace strix {

using Vector9f = Eigen::Matrix<float, 9, 1>;
using Matrix9f = Eigen::Matrix<float, 9, 9>;

}  // namespace strix
