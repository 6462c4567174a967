/// A card for tests: stalls and fails when told to, and remembers what it was asked.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <vector>

#include "BlockDevice.h"

namespace strix {

/// Reads a sector's memory only when its busy time is over, as a card behind DMA may: a caller that
/// touches the memory earlier corrupts the file.
class FakeCard {
 public:
  using Sector = const std::uint8_t (&)[kSectorSize];

  // Set by the test.
  std::uint64_t now = 0;                    ///< us, the test's clock
  std::function<std::uint64_t()> busyTime;  ///< us of the next access; none: always ready at once
  bool refusesSync = false;                 ///< every sync fails
  bool refuses = false;                     ///< every write and sync fails

  // Read by the test.
  std::uint32_t accesses = 0;  ///< writes and syncs, refused ones too
  std::uint32_t accessesWhileBusy = 0;
  std::uint32_t fullSectorWrites = 0;  ///< of a sector not written before
  std::uint32_t rewrites = 0;          ///< of one that was
  std::uint32_t syncs = 0;
  std::uint32_t syncedLength = 0;  ///< bytes

  void stallUntil(std::uint64_t time) { busyUntil_ = time; }

  bool busy() {
    if (now < busyUntil_) return true;
    transfer();
    return false;
  }

  bool writeSector(std::uint32_t index, Sector data) {
    if (!access()) return false;
    const bool isNew = index >= bytes_.size() / kSectorSize;
    isNew ? ++fullSectorWrites : ++rewrites;
    if (isNew) bytes_.resize((index + std::size_t{1}) * kSectorSize, 0xEE);
    pending_ = data;
    pendingIndex_ = index;
    return true;
  }

  bool sync(std::uint32_t length) {
    if (!access() || refusesSync) return false;
    transfer();
    ++syncs;
    syncedLength = length;
    return true;
  }

  /// The file as it was made durable last: what a power cut leaves.
  std::vector<std::uint8_t> durableFile() {
    transfer();
    return {bytes_.begin(), bytes_.begin() + syncedLength};
  }

  /// Every sector handed over, with the zeros behind the last bytes.
  const std::vector<std::uint8_t>& sectors() {
    transfer();
    return bytes_;
  }

 private:
  bool access() {
    ++accesses;
    if (now < busyUntil_) ++accessesWhileBusy;
    transfer();
    if (busyTime) busyUntil_ = now + busyTime();
    return !refuses;
  }

  void transfer() {
    if (pending_ == nullptr) return;
    std::memcpy(&bytes_[pendingIndex_ * kSectorSize], pending_, kSectorSize);
    pending_ = nullptr;
  }

  std::uint64_t busyUntil_ = 0;
  const std::uint8_t* pending_ = nullptr;  // memory the card has yet to read
  std::size_t pendingIndex_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace strix
