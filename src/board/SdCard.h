/// The log's card: one preallocated file a start, written by the sector behind the file system's
/// back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "BlockDevice.h"

#include <Arduino.h>
#include <SdFat.h>

namespace strix {

/// A BlockDevice on the Teensy's SDIO slot, FAT32 or exFAT.
///
/// In flight each sector goes to SdFat's FIFO driver exactly once and in order, only while the card
/// is not busy: 25 us. All that may wait up to a second in SdFat - a jump to another sector, the
/// end of the transfer, directory and allocation table - is done on the ground, in begin and
/// finish. So the newest sector is held back until the next one is begun, because the log writes it
/// again as it fills.
class SdCard {
 public:
  /// Starts the card, cuts the file of the last start to what was written, and makes this start's
  /// file, log_0001.ulg and up. Setup only. Takes 0.3 s; bound: 2.5 s, of which 1 s is the erasure.
  [[nodiscard]] bool begin();

  /// Bound: 1 us.
  [[nodiscard]] bool busy();

  /// Bound: 40 us when not busy and the card is sound. A card that dies within the transfer costs
  /// one wait of up to 1 s (SdFat's time-out), after which it is never touched again.
  [[nodiscard]] bool writeSector(std::uint32_t index, const std::uint8_t (&data)[kSectorSize]);

  /// Waits for nothing. What the card has taken survives a power cut as soon as the card has
  /// programmed it; the sector held back does not. Bound: 1 us.
  [[nodiscard]] bool sync(std::uint32_t length) const;

  /// Ends the log: the file is `length` bytes long and closed. On the ground, motors off: takes
  /// 20 ms; bound: 3 s. Then the card takes nothing more until the next start.
  bool finish(std::uint32_t length);

  /// Number in this start's file name; 0 without a card.
  [[nodiscard]] std::uint32_t logNumber() const { return logNumber_; }

 private:
  using Sector = std::array<std::uint8_t, kSectorSize>;
  static constexpr std::uint64_t kFileSize = 512ULL * 1024 * 1024;
  static constexpr std::uint64_t kLeastFileSize = 32ULL * 1024 * 1024;
  static constexpr std::uint64_t kMostClusters = 32768;  // FAT32 writes an entry for each, twice
  static constexpr std::uint32_t kMaxLogNumber = 9999;
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  [[nodiscard]] std::uint32_t newestLogNumber();
  void cutToWritten(std::uint32_t number);
  [[nodiscard]] bool isBlank(std::uint32_t sector);
  [[nodiscard]] bool allocate(std::uint32_t number);
  [[nodiscard]] bool makeValid(std::uint64_t size);
  [[nodiscard]] bool flushHeld();

  SdFs sd_;
  FsFile file_;
  std::uint32_t logNumber_ = 0;
  std::uint32_t firstSector_ = 0;  // of the file, on the card
  std::uint32_t sectors_ = 0;      // of the file
  std::uint32_t held_ = kNone;     // index of the sector held back
  bool writable_ = false;
  alignas(4) Sector sector_{};
};

}  // namespace strix
