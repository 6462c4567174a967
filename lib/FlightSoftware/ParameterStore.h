/// The parameters in memory that outlives the power: two slots, of which one is always whole.
///
/// A board's storage is halved. Each half holds one set, little-endian:
///
///     0   magic "STRX"
///     4   uint16 version of this layout, uint16 number of values
///     8   uint32 sequence: the newer set has the higher one, across its wrap
///     12  uint32 CRC-32 of bytes 4 to 11 and of all from 16 on
///     16  the key that signs telemetry, 32 bytes; all zero: none
///     48  a value each: uint32 hash of its name, float
///
/// Values go by name: firmware whose table grew, shrank or was sorted finds those it knows.
#pragma once

#include <cstring>

#include "Crc32.h"
#include "Parameters.h"

namespace strix {

using SigningKey = std::array<std::uint8_t, 32>;

/// FNV-1a, 32 bits (draft-eastlake-fnv).
[[nodiscard]] constexpr std::uint32_t nameHash(std::string_view name) {
  std::uint32_t hash = 2166136261U;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash;
}

[[nodiscard]] constexpr bool hashesDiffer() {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (nameHash(kParameterTable[i].name) == nameHash(kParameterTable[j].name)) return false;
    }
  }
  return true;
}
static_assert(hashesDiffer(), "two names with the same hash: change one");

/// What was found at power-up.
struct LoadReport {
  bool empty = false;              ///< nothing was ever saved: defaults
  bool damaged = false;            ///< a slot is torn or broken: it may have held newer values
  std::uint16_t refused = 0;       ///< values that the table does not allow: now their defaults
  std::uint16_t firstRefused = 0;  ///< place of the first of them
  std::uint16_t unknown = 0;       ///< values of other firmware: left out
};

enum class SaveState : std::uint8_t {
  Idle,  ///< nothing was asked for
  Saving,
  Done,    ///< written, and read back
  Failed,  ///< what reads back is not what was written; the set before is still there
};

/// @tparam Board  kStorageBytes, readStorage, writeStorage: Board.h
template <class Board>
class ParameterStore {
 public:
  static constexpr std::uint16_t kVersion = 1;
  /// Whole words: the Teensy keeps a word's four bytes in one sector of its flash, so that a step
  /// erases one at most.
  static constexpr std::size_t kSlotBytes = Board::kStorageBytes / 8 * 4;
  static constexpr std::size_t kBytesAStep = 4;  ///< written; four times as many are read back

  explicit ParameterStore(Board& board) : board_(board) {}

  /// At power-up. Where nothing is stored, `parameters` and `key` stay as they are.
  LoadReport load(Parameters& parameters, SigningKey& key) {
    LoadReport report;
    const std::array<Slot, 2> slots{examine(0), examine(1)};
    report.damaged = slots[0] == Slot::Damaged || slots[1] == Slot::Damaged;
    report.empty = slots[0] == Slot::Empty && slots[1] == Slot::Empty;
    const bool first = slots[0] == Slot::Intact;
    const bool second = slots[1] == Slot::Intact;
    if (!first && !second) return report;
    newest_ = second && (!first || isNewer(header(1).sequence, header(0).sequence)) ? 1 : 0;
    sequence_ = header(newest_).sequence;
    read(newest_, kHeaderBytes, key.data(), key.size());
    take(parameters, report);
    return report;
  }

  /// Begins to save these values, in the slot that does not hold the newest.
  /// @return nullptr, or why not
  [[nodiscard]] const char* save(const Parameters& parameters, const SigningKey& key) {
    if (state_ == SaveState::Saving) return "the parameters are just being saved: wait";
    std::uint8_t* out = &image_[kHeaderBytes];
    std::memcpy(out, key.data(), key.size());
    out += key.size();
    for (const ParameterInfo& info : kParameterTable) {
      const Entry entry{nameHash(info.name), parameters.*info.member};
      std::memcpy(out, &entry, sizeof entry);
      out += sizeof entry;
    }
    Header h{kMagic, kVersion, kParameterCount, sequence_ + 1, 0};
    Crc32 crc;
    std::memcpy(image_.data(), &h, sizeof h);
    crc.update(&image_[kCheckedFrom], kCheckedBytes);
    crc.update(&image_[kHeaderBytes], kImageBytes - kHeaderBytes);
    h.crc = crc.value();
    std::memcpy(image_.data(), &h, sizeof h);
    written_ = compared_ = 0;
    state_ = SaveState::Saving;
    return nullptr;
  }

  /// A few bytes of a save. With the motors off only, and not in a pass with a control tick: the
  /// Teensy stops for tens of milliseconds where its flash has to be erased. It may pause.
  void step() {
    if (state_ != SaveState::Saving) return;
    if (written_ < kWriteBytes) {
      if (!writeSome()) state_ = SaveState::Failed;
      return;
    }
    std::array<std::uint8_t, 4 * kBytesAStep> found{};
    const std::size_t size = smaller(found.size(), kImageBytes - compared_);
    read(oldest(), compared_, found.data(), size);
    if (std::memcmp(found.data(), &image_[compared_], size) != 0) {
      state_ = SaveState::Failed;
      return;
    }
    compared_ += size;
    if (compared_ < kImageBytes) return;
    newest_ = oldest();
    ++sequence_;
    state_ = SaveState::Done;
  }

  [[nodiscard]] SaveState state() const { return state_; }

 private:
  struct Header {
    std::uint32_t magic;
    std::uint16_t version;
    std::uint16_t count;
    std::uint32_t sequence;
    std::uint32_t crc;
  };
  struct Entry {
    std::uint32_t name;
    float value;
  };
  enum class Slot { Empty, Intact, Damaged };

  static constexpr std::uint32_t kMagic = 0x58525453;  // "STRX"
  static constexpr std::size_t kHeaderBytes = 16;
  static constexpr std::size_t kCheckedFrom = 4;
  static constexpr std::size_t kCheckedBytes = 8;
  static constexpr std::size_t kFirstEntry = kHeaderBytes + sizeof(SigningKey);
  static constexpr std::size_t kImageBytes = kFirstEntry + kParameterCount * sizeof(Entry);
  static constexpr std::size_t kMagicBytes = 4;
  static constexpr std::size_t kWriteBytes = kMagicBytes + kImageBytes;
  static_assert(sizeof(Header) == kHeaderBytes && sizeof(Entry) == 8);
  static_assert(kImageBytes <= kSlotBytes, "more parameters than a slot holds");

  [[nodiscard]] static std::size_t smaller(std::size_t a, std::size_t b) { return a < b ? a : b; }
  [[nodiscard]] static bool isNewer(std::uint32_t a, std::uint32_t b) {
    return static_cast<std::int32_t>(a - b) > 0;
  }
  [[nodiscard]] std::size_t oldest() const { return 1 - newest_; }

  void read(std::size_t slot, std::size_t offset, std::uint8_t* out, std::size_t size) {
    board_.readStorage(slot * kSlotBytes + offset, out, size);
  }

  [[nodiscard]] Header header(std::size_t slot) {
    std::array<std::uint8_t, kHeaderBytes> bytes{};
    read(slot, 0, bytes.data(), bytes.size());
    Header h{};
    std::memcpy(&h, bytes.data(), sizeof h);
    return h;
  }

  [[nodiscard]] Slot examine(std::size_t slot) {
    const Header h = header(slot);
    // As flash and as simple memory come: nothing was ever written, or not beyond its magic.
    for (const std::uint32_t blank : {0U, 0xFFFFFFFFU}) {
      if (h.magic == blank && h.sequence == blank && h.crc == blank) return Slot::Empty;
    }
    const std::size_t size = kFirstEntry + h.count * sizeof(Entry);
    if (h.magic != kMagic || h.version != kVersion || size > kSlotBytes) return Slot::Damaged;
    Crc32 crc;
    std::array<std::uint8_t, 64> bytes{};
    read(slot, kCheckedFrom, bytes.data(), kCheckedBytes);
    crc.update(bytes.data(), kCheckedBytes);
    for (std::size_t at = kHeaderBytes; at < size; at += bytes.size()) {
      const std::size_t part = smaller(bytes.size(), size - at);
      read(slot, at, bytes.data(), part);
      crc.update(bytes.data(), part);
    }
    return crc.value() == h.crc ? Slot::Intact : Slot::Damaged;
  }

  /// The values of the newest slot that this firmware knows.
  void take(Parameters& parameters, LoadReport& report) {
    const std::size_t count = header(newest_).count;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<std::uint8_t, sizeof(Entry)> bytes{};
      read(newest_, kFirstEntry + i * sizeof(Entry), bytes.data(), bytes.size());
      Entry entry{};
      std::memcpy(&entry, bytes.data(), sizeof entry);
      std::size_t place = 0;
      while (place < kParameterCount && nameHash(kParameterTable[place].name) != entry.name) {
        ++place;
      }
      if (place == kParameterCount) {
        ++report.unknown;
      } else if (checkParameter(place, entry.value, false) == nullptr) {
        setParameter(parameters, place, entry.value);
      } else {
        if (report.refused++ == 0) report.firstRefused = static_cast<std::uint16_t>(place);
      }
    }
  }

  /// First the magic is made invalid, then all else is written, last the magic: a save that is cut
  /// off anywhere leaves no slot that could pass for whole.
  [[nodiscard]] bool writeSome() {
    static constexpr std::array<std::uint8_t, kMagicBytes> kNoMagic{};
    const bool first = written_ < kMagicBytes;
    const bool last = written_ >= kImageBytes;
    const std::size_t offset = last ? written_ - kImageBytes : written_;
    const std::size_t end = first || last ? kMagicBytes : kImageBytes;
    const std::size_t size = smaller(kBytesAStep, end - offset);
    const std::uint8_t* data = first ? &kNoMagic[offset] : &image_[offset];
    written_ += size;
    return board_.writeStorage(oldest() * kSlotBytes + offset, data, size);
  }

  Board& board_;
  std::array<std::uint8_t, kImageBytes> image_{};
  std::size_t written_ = 0;   ///< of kWriteBytes
  std::size_t compared_ = 0;  ///< of kImageBytes
  std::size_t newest_ = 1;    ///< the slot that is kept
  std::uint32_t sequence_ = 0;
  SaveState state_ = SaveState::Idle;
};

}  // namespace strix
