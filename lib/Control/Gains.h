/// State-feedback gain of one vehicle. The values are generated: include/gains/, by `strix gains`.
#pragma once

#include <array>
#include <cstddef>

namespace strix {

constexpr std::size_t kControlCount = 4;  ///< thrust, tau_x, tau_y, tau_z
constexpr std::size_t kErrorCount = 12;   ///< position, velocity, alpha, body rate

struct Gains {
  const char* design = "";  ///< vehicle and method, for the log
  /// u = u_nom - k e. Rows in N, N m; columns in m, m/s, rad, rad/s; position and velocity errors
  /// in the heading frame (forward, right, down).
  std::array<std::array<float, kErrorCount>, kControlCount> k{};
  /// On the wrench that the lagging motors give now, as estimated, beside u_nom; N/N and N m/(N m).
  /// All zero: a design that takes the motors for quick.
  std::array<float, kControlCount> lag{};
  /// On the time integral of each channel's first error: down, right, forward, yaw for the rows
  /// thrust, tau_x, tau_y, tau_z; N/(m s), N m/(m s), N m/(rad s). All zero: no integral action.
  std::array<float, kControlCount> integral{};
};

}  // namespace strix
