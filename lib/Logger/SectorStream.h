/// The log as a stream of bytes: cut into blocks with a checksum, handed to the card by the sector.
#pragma once

#include <array>
#include <cstring>

#include "BlockDevice.h"
#include "Crc32.h"
#include "DataTypes.h"
#include "ULogFormat.h"

namespace strix {

/// Two sectors of staging memory: one that fills and the end of the message that filled it.
/// ready() is asked first in every pass; at most one of the writes or sync() follows. What the card
/// was handed stays untouched until it is no longer busy, so the card may read it by DMA.
template <class Card>
class SectorStream {
 public:
  static constexpr std::size_t kMaxBlock = 4096;       ///< bytes, log_block message included
  static constexpr std::size_t kMaxFirstBlock = 8192;  ///< of the first, which has the header
  static constexpr std::size_t kBlockEnd =
      ulog::kDataHeader + kPayloadSize<topic::LogBlock>;  ///< bytes of a log_block message
  static_assert(ulog::kMaxMessage + kBlockEnd <= kSectorSize, "fits behind an unfinished sector");

  explicit SectorStream(Card& card) : card_(card) {}

  void begin(std::uint32_t bootId, std::uint16_t blockTopicId) {
    bootId_ = bootId;
    blockTopicId_ = blockTopicId;
    sector_ = 0;
    used_ = 0;
    durable_ = 0;
    partialWritten_ = false;
    handedOver_ = false;
    sequence_ = 0;
    startBlock();
  }

  /// True when the card takes a sector now.
  [[nodiscard]] bool ready() {
    if (card_.busy()) return false;
    if (handedOver_) {  // the full sector is on the card: its memory is ours again
      used_ -= kSectorSize;
      std::memmove(&staging_[0], &staging_[kSectorSize], used_);
      handedOver_ = false;
    }
    return true;
  }

  [[nodiscard]] bool sectorFull() const { return used_ >= kSectorSize; }

  /// Bytes until the sector is full.
  [[nodiscard]] std::size_t sectorRoom() const { return sectorFull() ? 0 : kSectorSize - used_; }

  /// Bytes of messages that the block takes before it must be closed.
  [[nodiscard]] std::size_t blockRoom() const {
    const std::size_t taken = blockLength_ + kBlockEnd;
    const std::size_t most = sequence_ == 0 ? kMaxFirstBlock : kMaxBlock;
    return taken < most ? most - taken : 0;
  }

  /// Adds whole messages to a sector that is not full; only the last may reach beyond its end.
  void append(const std::uint8_t* data, std::size_t size) {
    std::memcpy(&staging_[used_], data, size);
    used_ += size;
    crc_.update(data, size);
    blockLength_ += size;
    partialWritten_ = false;
  }

  /// Ends a block that is not empty with its log_block message, which fits even after append.
  void closeBlock(LogTime now) {
    if (blockLength_ == 0) return;
    const auto blockLength = static_cast<std::uint32_t>(blockLength_ + kBlockEnd);
    ulog::Message end('D');
    end.add(blockTopicId_).add(now).add(bootId_).add(sequence_++).add(blockLength);
    end.add(std::uint32_t{0});  // counts in the message's size; the sum takes its place
    constexpr std::size_t kSummed = kBlockEnd - sizeof(std::uint32_t);
    append(end.data(), kSummed);
    const std::uint32_t sum = crc_.value();
    append(reinterpret_cast<const std::uint8_t*>(&sum), sizeof sum);
    startBlock();
  }

  /// Hands the full sector to the card. False: it failed and the sector is kept.
  [[nodiscard]] bool writeFull() {
    if (!card_.writeSector(sector_, sectorAt(0))) return false;
    handedOver_ = true;
    partialWritten_ = false;
    ++sector_;
    return true;
  }

  /// True when an unfinished sector has bytes that the card has not seen.
  [[nodiscard]] bool partialPending() const {
    return used_ > 0 && !sectorFull() && !partialWritten_;
  }

  /// Hands over the unfinished sector, zeros behind its bytes; it is written again as it fills.
  [[nodiscard]] bool writePartial() {
    std::memset(&staging_[used_], 0, kSectorSize - used_);
    if (!card_.writeSector(sector_, sectorAt(0))) return false;
    partialWritten_ = true;
    return true;
  }

  /// Makes all bytes handed over so far durable. For a sector that is not full, after writePartial.
  [[nodiscard]] bool sync() {
    if (!card_.sync(length())) return false;
    durable_ = length();
    return true;
  }

  /// Bytes in the stream. 32 bits are 7 h of flight; the card's file ends before.
  [[nodiscard]] std::uint32_t length() const {
    const std::size_t staged = handedOver_ ? used_ - kSectorSize : used_;
    return static_cast<std::uint32_t>(sector_ * kSectorSize + staged);
  }

  /// Bytes that survive a power cut once the card is ready again.
  [[nodiscard]] std::uint32_t durable() const { return durable_; }

 private:
  void startBlock() {
    crc_ = Crc32();
    blockLength_ = 0;
  }

  using Sector = const std::uint8_t[kSectorSize];
  [[nodiscard]] Sector& sectorAt(std::size_t offset) const {
    return *reinterpret_cast<Sector*>(&staging_[offset]);
  }

  Card& card_;
  std::uint32_t bootId_ = 0;
  std::uint16_t blockTopicId_ = 0;
  std::uint32_t sector_ = 0;     // index of the one that fills
  std::size_t used_ = 0;         // bytes staged
  std::uint32_t durable_ = 0;    // bytes
  bool partialWritten_ = false;  // the staged bytes, not yet a sector, are on the card
  bool handedOver_ = false;      // the card may still be reading the first sector
  std::uint32_t sequence_ = 0;   // of the block
  std::size_t blockLength_ = 0;  // bytes
  Crc32 crc_;
  alignas(32) std::array<std::uint8_t, 2 * kSectorSize> staging_{};  // 32: a cache line, for DMA
};

}  // namespace strix
