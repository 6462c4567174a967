/// The one place that includes Eigen, so that its settings are the same in every build.
#pragma once

// Our own code is compiled with -Wconversion -Werror; Eigen is not ours to warn about.
#pragma GCC system_header

// Vectorised kernels sum in another order on x86 than on ARM: the bits would differ (DESIGN.md, 6).
#ifndef EIGEN_DONT_VECTORIZE
#error "build with -DEIGEN_DONT_VECTORIZE (and -ffp-contract=off): see docs/determinism.md"
#endif

// Arduino.h defines these as macros; Eigen has template parameters of these names.
#ifdef B0
#error "include Eigen before Arduino.h"
#endif

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross products
