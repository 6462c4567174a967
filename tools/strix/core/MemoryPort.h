/// A port of the aircraft whose other end is the program: bytes in, bytes out, nothing waits.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

namespace strix {

class MemoryPort {
 public:
  // What a port offers.
  [[nodiscard]] std::size_t read(std::uint8_t* out, std::size_t most) {
    const std::size_t size = std::min(most, in_.size());
    std::memcpy(out, in_.data(), size);
    in_.erase(0, size);
    return size;
  }
  [[nodiscard]] std::size_t room() const { return kRoom - out_.size(); }
  void write(const std::uint8_t* data, std::size_t size) {
    out_.append(reinterpret_cast<const char*>(data), std::min(size, room()));
  }

  // The other end.
  void put(const char* data, std::size_t size) { in_.append(data, size); }
  [[nodiscard]] std::string take() { return std::exchange(out_, {}); }

 private:
  static constexpr std::size_t kRoom = 4096;  ///< as much as a USB serial port buffers
  std::string in_;
  std::string out_;
};

}  // namespace strix
