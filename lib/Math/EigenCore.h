/// The one place that includes Eigen, so that its settings are the same in every build.
#pragma once

// Our own code is compiled with -Wconversion -Werror; Eigen is not ours to warn about.
#pragma GCC system_header

// Vectorised kernels sum in another order on x86 than on ARM: the bits would differ (DESIGN.md, 6).
#ifndef EIGEN_DONT_VECTORIZE
#error "build with -DEIGEN_DONT_VECTORIZE (and -ffp-contract=off): see docs/determinism.md"
#endif

#ifdef __FAST_MATH__
#error "build without -ffast-math: see docs/determinism.md"
#endif

// Arduino.h defines these as macros; Eigen has template parameters of these names.
#ifdef B0
#error "include Eigen before Arduino.h"
#endif

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross products
#include <cfloat>

static_assert(FLT_EVAL_METHOD == 0, "a float must be computed as a float: no x87");
static_assert(EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4 && EIGEN_MINOR_VERSION == 0,
              "another release of Eigen may add in another order: run make determinism with it");
