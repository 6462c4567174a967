/// The rate of the control loop: one ESC pulse per command (DESIGN.md, 3).
#pragma once

#include <cstdint>

namespace strix {

constexpr std::uint32_t kControlRateHz = 500;
constexpr float kControlPeriod = 1.0F / static_cast<float>(kControlRateHz);  ///< s

}  // namespace strix
