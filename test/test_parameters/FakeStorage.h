/// Storage as a board offers it, whose power can be cut after any byte.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "ParameterStore.h"

namespace strix {

template <std::size_t Bytes>
struct FakeStorage {
  static constexpr std::size_t kStorageBytes = Bytes;
  static constexpr std::size_t kForEver = std::numeric_limits<std::size_t>::max();

  std::array<std::uint8_t, Bytes> bytes{};
  std::size_t powerFor = kForEver;  ///< bytes that are still written
  std::size_t written = 0;
  std::size_t mostAtOnce = 0;
  bool inOneWord = true;  ///< each write was
  bool answers = true;    ///< what writeStorage says

  explicit FakeStorage(std::uint8_t blank = 0xFF) { bytes.fill(blank); }

  void readStorage(std::size_t offset, std::uint8_t* out, std::size_t size) const {
    for (std::size_t i = 0; i < size; ++i) out[i] = bytes.at(offset + i);
  }
  [[nodiscard]] bool writeStorage(std::size_t offset, const std::uint8_t* data, std::size_t size) {
    mostAtOnce = size > mostAtOnce ? size : mostAtOnce;
    inOneWord = inOneWord && offset / 4 == (offset + size - 1) / 4;
    for (std::size_t i = 0; i < size; ++i) {
      if (powerFor == 0) continue;
      if (powerFor != kForEver) --powerFor;
      bytes.at(offset + i) = data[i];
      ++written;
    }
    return answers;
  }
};

using Storage = FakeStorage<4284>;

/// A whole set of values that differ from the defaults, the same for the same `which`: one mixture
/// of two of them is none of both.
[[nodiscard]] inline Parameters setNumber(unsigned which) {
  Parameters parameters;
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const ParameterInfo& info = kParameterTable[i];
    const auto step = static_cast<float>(which % 3 + 1);
    const float value = info.whole() ? info.lowest + (info.highest > 3.0F ? step : 0.0F)
                                     : info.lowest + step * 0.25F * (info.highest - info.lowest);
    setParameter(parameters, i, value);
  }
  return parameters;
}
[[nodiscard]] inline SigningKey keyNumber(unsigned which) {
  SigningKey key{};
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::uint8_t>(which * 50 + i);
  return key;
}

[[nodiscard]] inline bool same(const Parameters& a, const Parameters& b) {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    if (getParameter(a, i) != getParameter(b, i)) return false;
  }
  return true;
}

template <class Board>
SaveState save(ParameterStore<Board>& store, const Parameters& parameters, const SigningKey& key) {
  if (store.save(parameters, key) != nullptr) return SaveState::Idle;
  for (int i = 0; i < 10'000 && store.state() == SaveState::Saving; ++i) store.step();
  return store.state();
}

/// What a start of the aircraft finds.
struct Started {
  Parameters parameters;
  SigningKey key{};
  LoadReport report;

  [[nodiscard]] bool has(unsigned which) const {
    return same(parameters, setNumber(which)) && key == keyNumber(which);
  }
  [[nodiscard]] bool hasDefaults() const { return same(parameters, {}) && key == SigningKey{}; }
};

template <class Board>
Started start(Board& board) {
  Started s;
  s.report = ParameterStore<Board>(board).load(s.parameters, s.key);
  return s;
}

}  // namespace strix
