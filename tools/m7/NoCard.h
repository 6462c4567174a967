/// A card that takes everything and keeps nothing.
#pragma once

#include <BlockDevice.h>

#include <string>

namespace m7 {

/// For flights whose log nobody wants; a BlockDevice.
class NoCard {
 public:
  explicit NoCard(const std::string& /*path*/) {}
  [[nodiscard]] static bool open() { return true; }
  [[nodiscard]] static bool busy() { return false; }
  [[nodiscard]] static bool writeSector(std::uint32_t /*index*/,
                                        const std::uint8_t (& /*data*/)[strix::kSectorSize]) {
    return true;
  }
  [[nodiscard]] static bool sync(std::uint32_t /*length*/) { return true; }
};

}  // namespace m7
