/// The card's logs through a terminal: their list, and one of them as text.
///
///     log 12 1048576 bytes
///     U0ZYTnVsb...            base64 (RFC 4648), 48 bytes a line, padded where a block ends
///     end 1048576 bytes crc32 1a2b3c4d
#pragma once

#include <array>
#include <cstdint>

#include "Crc32.h"
#include "TextOut.h"
#include "Time.h"

namespace strix {

/// Where the logs are: the board, or whatever stands for it.
///
///   std::size_t logCount();                               0 without a card
///   bool logInfo(std::size_t i, std::uint32_t& number, std::uint32_t& bytes);
///   std::size_t readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
///                       std::size_t most);                0: not now
///
/// Each step prints at most one row or reads one block, and only when what it printed before is on
/// its way: a slow terminal makes it slow and nothing else.
template <class Bench>
class LogTransfer {
 public:
  static constexpr std::size_t kBlock = 512;  ///< a card's sector
  static constexpr std::size_t kBytesALine = 48;
  static constexpr Micros kPatience = 2'000'000;  ///< without a byte from the card

  LogTransfer(Bench& bench, TextOut& out) : bench_(bench), out_(out) {}

  void startList() {
    task_ = Task::List;
    row_ = 0;
    count_ = bench_.logCount();
  }

  void startGet(Micros now, std::uint32_t number) {
    task_ = Task::Find;
    row_ = 0;
    count_ = bench_.logCount();
    number_ = number;
    heard_ = now;
  }

  void stop() { task_ = Task::None; }
  [[nodiscard]] bool active() const { return task_ != Task::None; }

  /// @return nullptr, or why it has stopped
  const char* step(Micros now) {
    if (!out_.empty()) heard_ = now;  // it waits for the terminal, not for the card
    if (task_ == Task::None || !out_.empty()) return nullptr;
    const char* const refusal = task_ == Task::List   ? list()
                                : task_ == Task::Find ? find(now)
                                                      : send(now);
    if (refusal != nullptr) stop();
    return refusal;
  }

 private:
  enum class Task { None, List, Find, Send };

  const char* list() {
    std::uint32_t number = 0;
    std::uint32_t bytes = 0;
    if (row_ == count_) {
      if (count_ == 0) return "there are no logs: is there a card?";
      stop();
      return nullptr;
    }
    if (row_ == 0) out_ << "LOG" << Column{8} << "BYTES\n";
    if (bench_.logInfo(row_, number, bytes)) out_ << number << Column{8} << bytes << "\n";
    ++row_;
    return nullptr;
  }

  const char* find(Micros now) {
    if (row_ == count_) return "there is no log of that number: see log list";
    std::uint32_t number = 0;
    if (!bench_.logInfo(row_++, number, size_) || number != number_) return nullptr;
    out_ << "log " << number_ << " " << size_ << " bytes\n";
    sent_ = 0;
    crc_ = Crc32{};
    heard_ = now;
    task_ = Task::Send;
    return nullptr;
  }

  const char* send(Micros now) {
    if (sent_ == size_) {
      out_ << "end " << size_ << " bytes crc32 ";
      for (int shift = 28; shift >= 0; shift -= 4) {
        letter("0123456789abcdef"[crc_.value() >> static_cast<unsigned>(shift) & 0xFU]);
      }
      out_ << "\n";
      stop();
      return nullptr;
    }
    std::array<std::uint8_t, kBlock> block{};
    const std::size_t left = size_ - sent_;
    const std::size_t wanted = left < kBlock ? left : kBlock;
    const std::size_t found = bench_.readLog(number_, sent_, block.data(), wanted);
    if (found == 0 || found > wanted) {
      return elapsed(now, heard_) < kPatience ? nullptr : "the card does not give the log";
    }
    heard_ = now;
    crc_.update(block.data(), found);
    for (std::size_t at = 0; at < found; at += kBytesALine) {
      line(&block[at], found - at < kBytesALine ? found - at : kBytesALine);
    }
    sent_ += static_cast<std::uint32_t>(found);
    return nullptr;
  }

  /// RFC 4648, section 4.
  void line(const std::uint8_t* bytes, std::size_t size) {
    constexpr const char* kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t at = 0; at < size; at += 3) {
      std::uint32_t three = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        three = three << 8U | (at + i < size ? bytes[at + i] : 0U);
      }
      for (unsigned i = 0; i < 4; ++i) {
        letter(at + i <= size ? kLetters[three >> (18U - 6U * i) & 0x3FU] : '=');
      }
    }
    out_ << "\n";
  }

  void letter(char c) { out_ << std::array<char, 2>{c, '\0'}.data(); }

  Bench& bench_;
  TextOut& out_;
  Task task_ = Task::None;
  std::size_t row_ = 0;    ///< of the list
  std::size_t count_ = 0;  ///< of logs
  std::uint32_t number_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t sent_ = 0;
  Crc32 crc_;
  Micros heard_ = 0;  ///< when the card gave something last
};

}  // namespace strix
