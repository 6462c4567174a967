/// A card for tests: stalls, fails, dies and is pulled when told to, and remembers what it was
/// asked and what it would have if the power failed now.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <vector>

#include "BlockDevice.h"

namespace strix {

/// Reads a sector's memory only when its busy time is over, as a card behind DMA may: a caller that
/// touches the memory earlier corrupts the file.
class FakeCard {
 public:
  using Sector = const std::uint8_t (&)[kSectorSize];
  static constexpr std::uint64_t kForEver = ~std::uint64_t{0};

  /// What a power cut makes of the sector that is being programmed.
  enum class Tear { Old, HalfNew, Noise };

  // Set by the test.
  std::uint64_t now = 0;                    ///< us, the test's clock
  std::function<std::uint64_t()> busyTime;  ///< us of the next access; none: always ready at once
  bool refusesSync = false;                 ///< every sync fails
  bool refuses = false;                     ///< every write and sync fails
  std::map<std::uint32_t, std::uint64_t> stalls;  ///< us busy longer after a sector's first write
  std::uint32_t diesAt = ~0U;                     ///< sector from which on it refuses everything
  std::uint32_t pulledAt = ~0U;    ///< sector that it takes and after which it is busy for ever
  std::uint32_t writeTime = 0;     ///< us of the caller's time for each sector
  std::function<void()> onAccess;  ///< called before and after each write and sync

  // Read by the test.
  std::uint32_t accesses = 0;  ///< writes and syncs, refused ones too
  std::uint32_t accessesWhileBusy = 0;
  std::uint32_t fullSectorWrites = 0;  ///< of a sector not written before
  std::uint32_t rewrites = 0;          ///< of one that was
  std::uint32_t syncs = 0;
  std::uint32_t syncedLength = 0;  ///< bytes, from when the card is no longer busy with it
  std::uint64_t timeTaken = 0;     ///< us of the caller's time so far

  void stallUntil(std::uint64_t time) { busyUntil_ = time; }

  bool busy() {
    if (now < busyUntil_) return true;
    transfer();
    return false;
  }

  bool writeSector(std::uint32_t index, Sector data) {
    timeTaken += writeTime;
    if (index >= diesAt) refuses = true;
    const bool isNew = index >= sectors_.size();
    if (!access()) return told(false);
    isNew ? ++fullSectorWrites : ++rewrites;
    while (index >= sectors_.size()) sectors_.emplace_back().fill(0xEE);
    pending_ = data;
    pendingIndex_ = index;
    const auto stall = stalls.find(index);
    if (isNew && stall != stalls.end()) busyUntil_ = now + stall->second;
    if (index >= pulledAt) busyUntil_ = kForEver;
    return told(true);
  }

  bool sync(std::uint32_t length) {
    if (!access() || refusesSync) return told(false);
    transfer();
    ++syncs;
    syncingLength_ = length;
    if (now >= busyUntil_) transfer();
    return told(true);
  }

  /// The file as it was made durable last: what a power cut leaves of a card that keeps all since
  /// then in memory of its own.
  std::vector<std::uint8_t> durableFile() {
    std::vector<std::uint8_t> file = sectors();
    file.resize(syncedLength);
    return file;
  }

  /// What a power cut leaves of a card that programs each sector at once: brings `bytes` up to date
  /// from byte `from` on, where a sector begins, for a test that cuts often.
  void cutFile(Tear tear, std::vector<std::uint8_t>& bytes, std::size_t from = 0) const {
    bytes.resize(from);
    append(bytes, from / kSectorSize);
    if (pending_ == nullptr) return;
    std::uint8_t* sector = &bytes[pendingIndex_ * kSectorSize];
    if (now >= busyUntil_) {
      std::memcpy(sector, pending_, kSectorSize);
    } else if (tear == Tear::HalfNew) {
      std::memcpy(sector, pending_, kSectorSize / 2);
    } else if (tear == Tear::Noise) {
      for (std::size_t i = 0; i < kSectorSize; ++i) {
        sector[i] = static_cast<std::uint8_t>(i * 167 + (i >> 3U) + pendingIndex_);
      }
    }
  }

  /// Every sector handed over, with the zeros behind the last bytes.
  template <class Bytes = std::vector<std::uint8_t>>
  Bytes sectors() {
    transfer();
    Bytes bytes;
    bytes.reserve(sectors_.size() * kSectorSize);
    append(bytes, 0);
    return bytes;
  }

 private:
  bool access() {
    if (onAccess) onAccess();
    ++accesses;
    if (now < busyUntil_) ++accessesWhileBusy;
    transfer();
    if (busyTime) busyUntil_ = now + busyTime();
    return !refuses;
  }

  bool told(bool success) const {
    if (onAccess) onAccess();
    return success;
  }

  template <class Bytes>
  void append(Bytes& bytes, std::size_t firstSector) const {
    for (std::size_t i = firstSector; i < sectors_.size(); ++i) {
      bytes.insert(bytes.end(), sectors_[i].begin(), sectors_[i].end());
    }
  }

  /// What the card does until it is ready again.
  void transfer() {
    if (now >= busyUntil_) syncedLength = syncingLength_;
    if (pending_ == nullptr) return;
    std::memcpy(sectors_[pendingIndex_].data(), pending_, kSectorSize);
    pending_ = nullptr;
  }

  std::uint64_t busyUntil_ = 0;
  std::uint32_t syncingLength_ = 0;
  const std::uint8_t* pending_ = nullptr;  // memory the card has yet to read
  std::size_t pendingIndex_ = 0;
  /// Grows without a copy: a flight's log is a third of the memory of the emulated Cortex-M7.
  std::deque<std::array<std::uint8_t, kSectorSize>> sectors_;
};

}  // namespace strix
