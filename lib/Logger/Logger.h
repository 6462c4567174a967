/// The flight log: records go into rings at once, and from there to the card when it has time.
#pragma once

#include <string_view>
#include <tuple>

#include "LogHeader.h"
#include "LogStreams.h"
#include "SectorStream.h"
#include "Time.h"

namespace strix {

/// Writes a ULog file to any BlockDevice. Only forceWriteAndFlush waits for the card, and it has a
/// deadline. About 340 KB, nearly all of it rings (LogStreams.h): put it where RAM is plenty.
template <class Card>
class Logger {
 public:
  static constexpr std::size_t kTextLength = 100;  ///< longer texts are cut

  explicit Logger(Card& card) : stream_(card) {}

  /// Starts a new log at the card's first sector; the header goes out with the first writes. Must
  /// be called before anything else: it also clears memory that no start-up code zeroed (RAM2).
  void begin(LogTime now, const LogIdentity& identity);

  /// Logs a record: one copy into its ring. A full ring drops the record and counts it.
  /// @tparam Instance  ULog multi_id
  template <std::uint8_t Instance = 0, class Topic>
  void log(const Topic& record) {
    constexpr std::size_t kId = logStreamId<Topic, Instance>();
    std::get<kId>(streams_).push(static_cast<std::uint16_t>(kId), record);
  }

  void logIMU(const topic::SensorCombined& record) { log(record); }
  void logMag(const topic::SensorMag& record) { log(record); }
  void logAlt(const topic::SensorBaro& record) { log(record); }
  void logGPS(const topic::VehicleGpsPosition& record) { log(record); }
  template <AidSource Source>
  void logAid(const topic::EstimatorAidSource& record) {
    log<static_cast<std::uint8_t>(Source)>(record);
  }

  /// Everything a control tick logs.
  void logGNC(const GncRecords& records);

  /// A line for a person, e.g. "armed".
  void logText(ulog::LogLevel level, LogTime now, std::string_view text);

  /// To be called once a pass. At kLogWriteRateHz it begins to empty the rings; each call then
  /// hands one sector to the card, if the card is not busy, until they are empty.
  void write(LogTime now);

  /// To be called once a pass, after write. At kLogSyncRateHz it asks for what is in the stream to
  /// be made durable; the next calls of write do it, ahead of more data.
  void flush(LogTime now);

  /// Asks for all that was logged so far to be made durable as soon as the card can; write() sees
  /// to it, and nothing waits. saved() is true when it is done.
  void save() {
    draining_ = true;
    paused_ = false;
    saving_ = Saving::Empties;
  }
  [[nodiscard]] bool saved() const { return saving_ == Saving::Done; }

  /// Writes all there is and makes it durable, within a time limit. For when the motors are off.
  /// @param clock   returns Micros, which must advance from call to call while the card is busy
  /// @param budget  us. The card's own time for one sector or sync comes on top
  /// @return true when everything is safe on the card
  template <class Clock>
  bool forceWriteAndFlush(Clock&& clock, Micros budget);

  /// True when the log cannot be relied on: the card refused kMaxFailures times in a row, and
  /// nothing more is written, or it has been busy for kLongestBusy. If that comes to an end, it
  /// goes on.
  [[nodiscard]] bool failed() const {
    return dead() || (stalled_ && now_ - stalledSince_ >= kLongestBusy);
  }

  /// Records lost to full rings, all topics and texts.
  [[nodiscard]] std::uint32_t dropped() const { return status(0).dropped; }

  /// The log's own state as it is logged.
  [[nodiscard]] topic::LogStatus status(LogTime now) const;

 private:
  static constexpr std::uint32_t kMaxFailures = 20;    // at one try each 50 ms: a second
  static constexpr LogTime kLongestBusy = 10'000'000;  // us; 4 s were measured on a sound card
  static_assert(LogHeader::maxSize() + SectorStream<Card>::kBlockEnd <=
                    SectorStream<Card>::kMaxFirstBlock,
                "the header is the first block, with the first records");

  // A text fills its record only in part: the size in its header says how far.
  using TextRing = RingBuffer<ulog::kMessageHeader + 1 + sizeof(LogTime) + kTextLength, 32>;
  static_assert(TextRing::kRecordSize <= ulog::kMaxMessage);

  enum class Saving : std::uint8_t { Done, Empties, Syncs };

  void step(LogTime now);
  void goOnSaving();
  void fillSector(LogTime now);
  bool takeFromRings(LogTime now);
  void takeText(LogTime now);
  template <class Ring>
  void take(Ring& ring, LogTime now);
  void appendHeader();
  void note(bool success);
  [[nodiscard]] bool dead() const { return failuresInARow_ >= kMaxFailures; }
  [[nodiscard]] bool headerDone() const { return headerItem_ == LogHeader::kItems; }

  template <class Visitor>
  void forEachStream(Visitor&& visit) {
    std::apply([&](auto&... stream) { (visit(stream), ...); }, streams_);
  }

  LogStreams streams_;
  TextRing texts_;
  SectorStream<Card> stream_;
  LogIdentity identity_;
  LogTime begun_ = 0;
  LogTime now_ = 0;             // of the latest call
  std::size_t headerItem_ = 0;  // next to be written
  PeriodicTask writeTask_{periodFromHz(kLogWriteRateHz)};
  PeriodicTask syncTask_{periodFromHz(kLogSyncRateHz)};
  bool draining_ = false;  // the rings are being emptied
  bool syncAsked_ = false;
  bool syncing_ = false;   // the block is closed: partial sector, then sync
  bool settling_ = false;  // the card is busy with a sync
  bool paused_ = false;    // after a failure, until the next write period
  Saving saving_ = Saving::Done;
  bool stalled_ = false;  // the card keeps us waiting since stalledSince_
  LogTime stalledSince_ = 0;
  std::uint32_t longestStall_ = 0;  // us
  std::uint32_t failures_ = 0;
  std::uint32_t failuresInARow_ = 0;
};

template <class Card>
void Logger<Card>::begin(LogTime now, const LogIdentity& identity) {
  forEachStream([](auto& stream) { stream.clear(); });
  texts_.clear();
  stream_.begin(identity.bootId, kLogBlockId);
  identity_ = identity;
  begun_ = now;
  now_ = now;
  headerItem_ = 0;
  writeTask_.start(static_cast<Micros>(now));
  syncTask_.start(static_cast<Micros>(now));
  draining_ = syncAsked_ = syncing_ = settling_ = paused_ = stalled_ = false;
  saving_ = Saving::Done;
  longestStall_ = failures_ = failuresInARow_ = 0;
}

template <class Card>
void Logger<Card>::logGNC(const GncRecords& records) {
  log(records.attitude);
  log(records.rate);
  log(records.position);
  log(records.trajectorySetpoint);
  log(records.attitudeSetpoint);
  log(records.wrenchSetpoint);
  log(records.wrenchAchieved);
  log(records.outputs);
  log(records.tick);
}

template <class Card>
void Logger<Card>::logText(ulog::LogLevel level, LogTime now, std::string_view text) {
  ulog::Message message('L');
  message.add(level).add(now).addText(text.substr(0, kTextLength));
  std::uint8_t* const record = texts_.add();
  if (record != nullptr) std::memcpy(record, message.data(), message.size());
}

template <class Card>
void Logger<Card>::write(LogTime now) {
  now_ = now;
  if (writeTask_.run(static_cast<Micros>(now))) {
    draining_ = true;
    paused_ = false;
  }
  if (!paused_) step(now);
  if (saving_ != Saving::Done) goOnSaving();
}

/// First the rings into the stream, then a sync of all of it.
template <class Card>
void Logger<Card>::goOnSaving() {
  if (saving_ == Saving::Empties && !draining_) {
    syncAsked_ = true;
    saving_ = Saving::Syncs;
  } else if (saving_ == Saving::Syncs && !syncAsked_ && !syncing_ && !settling_) {
    saving_ = Saving::Done;
  }
}

template <class Card>
void Logger<Card>::flush(LogTime now) {
  now_ = now;
  if (!syncTask_.run(static_cast<Micros>(now))) return;
  log(status(now));
  syncAsked_ = true;
}

template <class Card>
template <class Clock>
bool Logger<Card>::forceWriteAndFlush(Clock&& clock, Micros budget) {
  const Micros start = clock();
  const LogTime begun = now_;
  bool told = false;
  draining_ = true;
  paused_ = false;
  while (!dead()) {
    const Micros spent = elapsed(clock(), start);
    if (!draining_ && !syncAsked_ && !syncing_ && !settling_) {  // all is in the stream
      if (!told) {
        log(status(begun + spent));  // the final count of drops: now its ring has room for it
        draining_ = told = true;
      } else if (stream_.durable() == stream_.length()) {
        return true;
      } else {
        syncAsked_ = true;
      }
    }
    if (spent >= budget) return false;
    flush(begun + spent);  // keeps its rate: a card too slow for all still keeps what it took
    write(begun + spent);
  }
  return false;
}

/// At most one access to the card.
template <class Card>
void Logger<Card>::step(LogTime now) {
  if (dead() || !(draining_ || syncAsked_ || syncing_ || settling_)) return;
  if (!stream_.ready()) {
    if (!stalled_) stalledSince_ = now;
    stalled_ = true;
    const auto wait = static_cast<std::uint32_t>(now - stalledSince_);
    if (wait > longestStall_) longestStall_ = wait;
    return;
  }
  stalled_ = settling_ = false;
  if (syncAsked_) {
    // A header cut short has no block end: log_block is not yet known to the reader.
    if (headerDone()) stream_.closeBlock(now);
    syncAsked_ = false;
    syncing_ = true;
  }
  if (!syncing_ && draining_) fillSector(now);
  if (stream_.sectorFull()) {
    note(stream_.writeFull());
  } else if (syncing_ && stream_.partialPending()) {
    note(stream_.writePartial());
  } else if (syncing_) {
    settling_ = stream_.sync();
    syncing_ = !settling_;
    note(settling_);
  } else {
    draining_ = false;  // nothing left that fills a sector
  }
}

/// Adds to the sector until it is full or there is nothing left.
template <class Card>
void Logger<Card>::fillSector(LogTime now) {
  while (!stream_.sectorFull()) {
    if (!headerDone()) {
      appendHeader();
    } else if (!texts_.empty()) {
      takeText(now);
    } else if (!takeFromRings(now)) {
      return;
    }
  }
}

/// Fills the sector from the rings, the one nearest to overflowing first. False: all are empty.
template <class Card>
bool Logger<Card>::takeFromRings(LogTime now) {
  constexpr std::size_t kFull = 1U << 20U;
  std::size_t first = 0;
  std::size_t most = 0;  // in parts of kFull
  std::size_t row = 0;
  forEachStream([&](auto& stream) {
    constexpr std::size_t kPart = kFull / std::decay_t<decltype(stream)>::kRecords;
    const std::size_t used = stream.ring.used() * kPart;
    if (used > most) {
      first = row;
      most = used;
    }
    ++row;
  });
  if (most == 0) return false;
  for (const bool before : {false, true}) {  // from the first on, then from the top to it
    row = 0;
    forEachStream([&](auto& stream) {
      if ((row++ < first) != before) return;
      while (!stream.ring.empty() && !stream_.sectorFull()) take(stream.ring, now);
    });
  }
  return true;
}

/// Moves whole messages from the ring's oldest on, up to the one that fills the sector.
template <class Card>
template <class Ring>
void Logger<Card>::take(Ring& ring, LogTime now) {
  constexpr std::size_t kSize = Ring::kRecordSize;
  if (stream_.blockRoom() < kSize) {
    stream_.closeBlock(now);
    return;
  }
  const std::size_t wanted = (stream_.sectorRoom() + kSize - 1) / kSize * kSize;
  const std::size_t allowed = stream_.blockRoom() / kSize * kSize;
  const std::size_t bytes = std::min({wanted, allowed, ring.chunkSize()});
  stream_.append(ring.tailPtr(), bytes);
  ring.advanceTail(bytes);
}

template <class Card>
void Logger<Card>::takeText(LogTime now) {
  std::uint16_t size = 0;
  std::memcpy(&size, texts_.tailPtr(), sizeof size);
  const std::size_t bytes = ulog::kMessageHeader + size;
  if (stream_.blockRoom() < bytes) {
    stream_.closeBlock(now);
    return;
  }
  stream_.append(texts_.tailPtr(), bytes);
  texts_.advanceTail(TextRing::kRecordSize);
}

template <class Card>
void Logger<Card>::appendHeader() {
  if (headerItem_ == 0) {
    const LogHeader::FileStart start = LogHeader::fileStart(begun_);
    stream_.append(start.data(), start.size());
  }
  LogHeader::item(headerItem_++, identity_, [this](const ulog::Message& message) {
    stream_.append(message.data(), message.size());
  });
}

/// Counts what the card answered. After a failure the next try waits for the next write period.
template <class Card>
void Logger<Card>::note(bool success) {
  failuresInARow_ = success ? 0 : failuresInARow_ + 1;
  if (success) return;
  ++failures_;
  paused_ = true;
}

template <class Card>
topic::LogStatus Logger<Card>::status(LogTime now) const {
  topic::LogStatus status;
  status.timestamp = now;
  status.bytes = stream_.length();
  status.write_errors = failures_;
  status.longest_stall_us = longestStall_;
  status.dropped_text = texts_.dropped();
  status.dropped = texts_.dropped();
  std::size_t row = 0;
  const auto count = [&](const auto& stream) {
    status.dropped_by_id[row++] = stream.ring.dropped();
    status.dropped += stream.ring.dropped();
  };
  std::apply([&](const auto&... stream) { (count(stream), ...); }, streams_);
  return status;
}

}  // namespace strix
