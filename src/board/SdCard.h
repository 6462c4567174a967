/// The log's card: one preallocated file a start, written by the sector behind the file system's
/// back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "BlockDevice.h"
#include "MissionText.h"

#include "ReadingTurn.h"

#include <Arduino.h>
#include <SdFat.h>

namespace strix {

/// A BlockDevice on the Teensy's SDIO slot, FAT32 or exFAT.
///
/// In flight each sector goes into the controller's FIFO, only while the card is not busy. SdFat
/// does the same, but waits for the FIFO without an end; so the transfer is our own, with a
/// deadline, and SdFat gives the commands around it. Directory and allocation table are touched on
/// the ground only, in begin. To jump back to a sector costs the card much time, so the newest one
/// is held back until the next is begun or the log is synced: the log writes it again as it fills.
class SdCard {
 public:
  /// Starts the card, cuts the file of the last start to what was written, and makes this start's
  /// file, log_0001.ulg and up. Setup only. Takes 0.3 s; bound: 2.5 s, of which 1 s is the erasure.
  [[nodiscard]] bool begin();

  /// Bound: 1 us; 20 us once after each sync.
  [[nodiscard]] bool busy();

  /// Takes 25 us, the first after a sync 40 us. Bound: 0.25 ms with a controller that answers. A
  /// card that fails is never touched again.
  [[nodiscard]] bool writeSector(std::uint32_t index, const std::uint8_t (&data)[kSectorSize]);

  /// Hands over the sector held back and ends the transfer, upon which the card has to program
  /// all it has. That is done when busy() is false again: nothing waits here. Bound as writeSector.
  [[nodiscard]] bool sync(std::uint32_t length);

  /// What mission.txt holds, read by begin(); empty without one. A longer one is cut, one byte
  /// beyond what a mission may have.
  [[nodiscard]] std::string_view missionText() const { return {mission_.data(), missionSize_}; }

  /// Number in this start's file name; 0 without a card.
  [[nodiscard]] std::uint32_t logNumber() const { return logNumber_; }

  /// The newest kListed logs, the oldest of them first, the running one last. As begin() found
  /// them: the card is not asked.
  [[nodiscard]] std::size_t logCount() const { return logCount_; }
  [[nodiscard]] bool logInfo(std::size_t index, std::uint32_t& number, std::uint32_t& bytes) const;

  /// Bytes of a log; of the running one what has been handed over. The log that is being written
  /// waits meanwhile, in turns (ReadingTurn.h). Only with the motors off: takes 1 ms, 10 ms when it
  /// opens a file; bound: SdFat's 1 s.
  /// @return how many; 0: not now, or not at all
  [[nodiscard]] std::size_t readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
                                    std::size_t most);

  /// The card is the running log's again. Bound: SdFat's 1 s, 0.1 ms with a card that answers.
  void endReading();

 private:
  struct Listed {
    std::uint32_t number = 0;
    std::uint32_t bytes = 0;
  };
  static constexpr std::size_t kListed = 64;

  using Sector = std::array<std::uint8_t, kSectorSize>;
  static constexpr std::uint64_t kFileSize = 512ULL * 1024 * 1024;
  static constexpr std::uint64_t kLeastFileSize = 32ULL * 1024 * 1024;
  static constexpr std::uint64_t kMostClusters = 32768;  // FAT32 writes an entry for each, twice
  static constexpr std::uint32_t kMaxLogNumber = 9999;
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  void readMission();
  void listLogs();
  void list(const Listed& log);
  void cutToWritten(Listed& log);
  [[nodiscard]] bool isBlank(std::uint32_t sector);
  [[nodiscard]] bool allocate(std::uint32_t number);
  [[nodiscard]] bool makeValid(std::uint64_t size);
  [[nodiscard]] bool flushHeld();
  [[nodiscard]] bool transferEnded();
  [[nodiscard]] std::uint32_t handedOver() const;
  [[nodiscard]] SdioCard& sdio();
  [[nodiscard]] bool fillFifo();
  [[nodiscard]] bool sectorTaken();

  SdFs sd_;
  FsFile file_;
  std::uint32_t logNumber_ = 0;
  std::uint32_t firstSector_ = 0;  // of the file, on the card
  std::uint32_t sectors_ = 0;      // of the file
  std::uint32_t held_ = kNone;     // index of the sector in sector_
  bool heldIsNew_ = false;         // the card has not seen it
  bool open_ = false;              // a transfer of sectors in a row has begun
  bool filled_ = false;            // a sector is on its way from the FIFO
  bool stopAsked_ = false;         // the transfer is to be ended when the card is ready
  bool alive_ = false;             // it has not failed since begin
  bool writable_ = false;          // and there is a file for the log
  std::array<char, mission_text::kMostBytes + 1> mission_{};
  std::size_t missionSize_ = 0;
  std::array<Listed, kListed> logs_{};  // by number, the newest last
  std::size_t logCount_ = 0;
  ReadingTurn turn_;
  FsFile reading_;
  std::uint32_t readingNumber_ = 0;  // of the file in reading_; 0: none
  bool readOpen_ = false;            // a transfer from the card has begun
  alignas(4) Sector sector_{};
};

}  // namespace strix
