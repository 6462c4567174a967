/// A ring of equally long records between one producer and one consumer in the same loop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace strix {

/// First in, first out. Its memory is a whole number of records, so no record straddles the end and
/// the chunkSize() bytes from tailPtr() on are whole records ready to be written. A full ring drops
/// the new record and counts it, so that what it holds has no gap inside.
/// Not for interrupts: push and advanceTail must not preempt each other.
template <std::size_t RecordSize, std::size_t Capacity>
class RingBuffer {
  static_assert(RecordSize > 0 && Capacity > 0);

 public:
  using Record = std::array<std::uint8_t, RecordSize>;
  static constexpr std::size_t kRecordSize = RecordSize;
  static constexpr std::size_t kCapacity = Capacity;

  // The memory is left as it is: half a megabyte need not be cleared to be empty.
  RingBuffer() { clear(); }  // NOLINT(cppcoreguidelines-pro-type-member-init)

  /// Empties the ring and zeroes the count of drops.
  void clear() {
    tail_ = 0;
    used_ = 0;
    dropped_ = 0;
  }

  /// False when the ring is full: the record is dropped and counted.
  bool push(const Record& record) {
    std::uint8_t* const place = add();
    if (place == nullptr) return false;
    std::memcpy(place, record.data(), RecordSize);
    return true;
  }

  /// Adds a record to be written in place: RecordSize bytes. Null when the ring is full: dropped
  /// and counted.
  [[nodiscard]] std::uint8_t* add() {
    if (used_ == Capacity) {
      ++dropped_;
      return nullptr;
    }
    std::size_t head = tail_ + used_;
    if (head >= Capacity) head -= Capacity;
    ++used_;
    return &memory_[head * RecordSize];
  }

  /// Bytes from the oldest record on that lie in one piece: whole records.
  [[nodiscard]] std::size_t chunkSize() const {
    const std::size_t toEnd = Capacity - tail_;
    return (used_ < toEnd ? used_ : toEnd) * RecordSize;
  }

  /// The oldest record.
  [[nodiscard]] const std::uint8_t* tailPtr() const { return &memory_[tail_ * RecordSize]; }

  /// Frees the oldest records.
  /// @param bytes  at most chunkSize(); a part of a record is not freed
  void advanceTail(std::size_t bytes) {
    std::size_t records = bytes / RecordSize;
    if (records > used_) records = used_;
    used_ -= records;
    tail_ = (tail_ + records) % Capacity;
  }

  [[nodiscard]] bool empty() const { return used_ == 0; }
  [[nodiscard]] std::size_t used() const { return used_; }  ///< records

  /// Records that found the ring full since clear().
  [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

 private:
  std::size_t tail_;  // record index of the oldest
  std::size_t used_;  // records
  std::uint32_t dropped_;
  std::array<std::uint8_t, RecordSize * Capacity> memory_;
};

}  // namespace strix
