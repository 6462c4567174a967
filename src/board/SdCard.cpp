#include "SdCard.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <SdCard/SdioTeensy.h>

namespace strix {

namespace {

// The emulated Teensy has no FIFO transfers; the real one waits for DMA, so it does not use it.
#ifdef STRIX_SD_DMA
constexpr std::uint8_t kTransfer = DMA_SDIO;
#else
constexpr std::uint8_t kTransfer = FIFO_SDIO;
#endif

constexpr bool kFifo = kTransfer == FIFO_SDIO;

constexpr std::uint32_t kFifoChunk = 16;   // words, the watermark that SdFat sets
constexpr std::uint32_t kFillBound = 200;  // us; the FIFO takes a whole sector, on the wire 41 us
constexpr std::uint32_t kTransferErrors =
    SDHC_IRQSTAT_DMAE | SDHC_IRQSTAT_AC12E | SDHC_IRQSTAT_DEBE | SDHC_IRQSTAT_DCE |
    SDHC_IRQSTAT_DTOE | SDHC_IRQSTAT_CIE | SDHC_IRQSTAT_CEBE | SDHC_IRQSTAT_CCE | SDHC_IRQSTAT_CTOE;

constexpr char kPrefix[] = "log_";
constexpr char kSuffix[] = ".ulg";

struct FileName {
  explicit FileName(std::uint32_t number) {
    std::snprintf(text, sizeof text, "%s%04u%s", kPrefix, static_cast<unsigned>(number), kSuffix);
  }
  char text[24] = {};
};

/// 0 when it is not the name of a log.
std::uint32_t numberOf(const char* name) {
  if (std::strncmp(name, kPrefix, sizeof kPrefix - 1) != 0) return 0;
  char* end = nullptr;
  const unsigned long number = std::strtoul(name + sizeof kPrefix - 1, &end, 10);
  return std::strcmp(end, kSuffix) == 0 ? static_cast<std::uint32_t>(number) : 0;
}

}  // namespace

bool SdCard::begin() {
  writable_ = false;
  alive_ = sd_.begin(SdioConfig(kTransfer));
  if (!alive_) return false;
  readMission();
  listLogs();
  const std::uint32_t newest = logCount_ == 0 ? 0 : logs_[logCount_ - 1].number;
  if (newest >= kMaxLogNumber) return false;
  if (newest > 0) cutToWritten(logs_[logCount_ - 1]);
  if (!allocate(newest + 1)) return false;
  logNumber_ = newest + 1;
  list({logNumber_, 0});
  held_ = kNone;
  heldIsNew_ = open_ = filled_ = stopAsked_ = false;
  writable_ = true;
  return true;
}

void SdCard::readMission() {
  missionSize_ = 0;
  FsFile file;
  if (!file.open("mission.txt", O_RDONLY)) return;
  const int size = file.read(mission_.data(), mission_.size());
  if (size > 0) missionSize_ = static_cast<std::size_t>(size);
  file.close();
}

void SdCard::listLogs() {
  logCount_ = 0;
  FsFile root;
  FsFile entry;
  if (!root.open("/", O_RDONLY)) return;
  while (entry.openNext(&root, O_RDONLY)) {
    char name[24] = {};
    entry.getName(name, sizeof name);
    const std::uint32_t number = numberOf(name);
    if (number != 0) list({number, static_cast<std::uint32_t>(entry.fileSize())});
    entry.close();
  }
}

/// In its place by number; the oldest one goes when there is no room.
void SdCard::list(const Listed& log) {
  std::size_t at = logCount_;
  while (at > 0 && logs_[at - 1].number > log.number) --at;
  if (logCount_ == kListed) {
    if (at == 0) return;
    std::copy(logs_.begin() + 1, logs_.begin() + at, logs_.begin());
    logs_[at - 1] = log;
    return;
  }
  std::copy_backward(logs_.begin() + at, logs_.begin() + logCount_, logs_.begin() + logCount_ + 1);
  logs_[at] = log;
  ++logCount_;
}

/// Without finish a file keeps its allocated size. The log is written in order onto erased sectors,
/// so its end is found by halving; where a card did not erase, the file is cut later, never
/// earlier.
void SdCard::cutToWritten(Listed& log) {
  FsFile file;
  if (!file.open(FileName(log.number).text, O_RDWR)) return;
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  const std::uint64_t size = file.fileSize();
  const bool whole = size >= kLeastFileSize && file.contiguousRange(&first, &last);
  if (whole && isBlank(last)) {
    std::uint32_t written = first;
    std::uint32_t blank = last;
    while (written < blank) {
      const std::uint32_t middle = written + (blank - written) / 2;
      if (isBlank(middle)) {
        blank = middle;
      } else {
        written = middle + 1;
      }
    }
    file.truncate(static_cast<std::uint64_t>(blank - first) * kSectorSize);
    log.bytes = static_cast<std::uint32_t>(file.fileSize());
  }
  file.close();
}

/// Erased sectors read as all zeros or all ones, by the card's choice. No sector of a log does.
bool SdCard::isBlank(std::uint32_t sector) {
  if (!sd_.card()->readSector(sector, sector_.data())) return false;
  const std::uint8_t filler = sector_.front();
  return (filler == 0x00 || filler == 0xFF) &&
         std::all_of(sector_.begin(), sector_.end(),
                     [filler](std::uint8_t byte) { return byte == filler; });
}

bool SdCard::allocate(std::uint32_t number) {
  if (!file_.open(FileName(number).text, O_RDWR | O_CREAT | O_EXCL)) return false;
  std::uint64_t size = std::min<std::uint64_t>(kFileSize, kMostClusters * sd_.bytesPerCluster());
  while (size >= kLeastFileSize && !file_.preAllocate(size)) size /= 2;
  std::uint32_t last = 0;
  if (size < kLeastFileSize || !makeValid(size) || !file_.contiguousRange(&firstSector_, &last)) {
    file_.remove();
    return false;
  }
  sectors_ = static_cast<std::uint32_t>(size / kSectorSize);
  if (last - firstSector_ + 1 < sectors_ || !sd_.card()->syncDevice()) return false;
  // Erased sectors are written faster, and show where a log ends that was cut off by the battery. A
  // card that cannot erase, or not within a second, does without.
  (void)sd_.card()->erase(firstSector_, last);
  return true;
}

/// An exFAT file is valid up to where it was written, and reads as zeros behind, whatever the card
/// holds: what goes to it by the sector would be lost. Writing the last sector makes all of it
/// valid. SdFat refuses to seek there, so the position is set: the first write shows the number of
/// the first cluster, and the clusters follow each other.
bool SdCard::makeValid(std::uint64_t size) {
  if (sd_.fatType() != FAT_TYPE_EXFAT) return true;
  sector_.fill(0);
  if (file_.write(sector_.data(), sector_.size()) != sector_.size()) return false;
  fspos_t position{};
  file_.fgetpos(&position);
  position.cluster += static_cast<std::uint32_t>((size - 1) / sd_.bytesPerCluster());
  position.position = size - kSectorSize;
  file_.fsetpos(&position);
  return file_.write(sector_.data(), sector_.size()) == sector_.size() && file_.sync();
}

bool SdCard::busy() {
  if (!writable_) return false;
  if (turn_.over(::micros())) endReading();
  if (turn_.reading()) return true;
  if (filled_ && (SDHC_IRQSTAT & (SDHC_IRQSTAT_TC | kTransferErrors)) == 0) return true;
  if (!filled_ && sd_.card()->isBusy()) return true;
  if (!stopAsked_) return false;
  return transferEnded() && sd_.card()->isBusy();
}

/// Ends the transfer of sectors in a row; the card then programs all it has. Not to be asked while
/// a sector is on its way. False: the card failed.
bool SdCard::transferEnded() {
  stopAsked_ = open_ = false;
  alive_ = sectorTaken() && sdio().stopTransmission(false);
  writable_ = writable_ && alive_;
  return alive_;
}

bool SdCard::writeSector(std::uint32_t index, const std::uint8_t (&data)[kSectorSize]) {
  if (!writable_ || index >= sectors_) return false;
  const bool next = held_ == kNone ? index == 0 : index == held_ + 1;
  if (!next && index != held_) return false;
  if (next && !flushHeld()) return false;
  std::copy(std::begin(data), std::end(data), sector_.begin());
  held_ = index;
  heldIsNew_ = true;
  return true;
}

bool SdCard::sync(std::uint32_t /*length*/) {
  if (!writable_ || !flushHeld()) return false;
  stopAsked_ = open_;
  return true;
}

bool SdCard::flushHeld() {
  if (!heldIsNew_) return true;
  if (turn_.reading()) endReading();
  const std::uint32_t sector = firstSector_ + held_;
  if (kFifo) {
    writable_ = (open_ || sdio().writeStart(sector)) && fillFifo();
    open_ = writable_;
  } else {
    writable_ = sd_.card()->writeSector(sector, sector_.data());
  }
  heldIsNew_ = false;
  alive_ = writable_;
  return writable_;
}

std::uint32_t SdCard::handedOver() const {
  return held_ == kNone ? 0 : held_ * static_cast<std::uint32_t>(kSectorSize);
}

bool SdCard::logInfo(std::size_t index, std::uint32_t& number, std::uint32_t& bytes) const {
  if (index >= logCount_) return false;
  number = logs_[index].number;
  bytes = number == logNumber_ ? handedOver() : logs_[index].bytes;
  return true;
}

std::size_t SdCard::readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
                            std::size_t most) {
  if (!alive_) return 0;
  if (!turn_.take(::micros())) {
    if (turn_.reading()) endReading();
    return 0;
  }
  // What is being written goes first: its sector, the end of its transfer, the card's programming.
  if (filled_ && (SDHC_IRQSTAT & (SDHC_IRQSTAT_TC | kTransferErrors)) == 0) return 0;
  if (open_ && !transferEnded()) return 0;
  if (!readOpen_ && sd_.card()->isBusy()) return 0;
  readOpen_ = true;
  if (number != readingNumber_) {
    reading_.close();
    readingNumber_ = reading_.open(FileName(number).text, O_RDONLY) ? number : 0;
    if (readingNumber_ == 0) return 0;
  }
  if (number == logNumber_) {
    if (offset >= handedOver()) return 0;
    most = std::min<std::size_t>(most, handedOver() - offset);
  }
  if (!reading_.seekSet(offset)) return 0;
  const int count = reading_.read(out, most);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

void SdCard::endReading() {
  if (readOpen_) (void)sd_.card()->syncDevice();  // a write would meet the transfer still open
  readOpen_ = false;
  turn_.end(::micros());
}

/// begin started it with an SdioConfig, so it is one.
SdioCard& SdCard::sdio() { return *static_cast<SdioCard*>(sd_.card()); }

/// SdFat's writeData with an end to its waiting. The next sector of an open transfer follows the
/// last one on the card.
bool SdCard::fillFifo() {
  if (!sectorTaken()) return false;
  if ((SDHC_PRSSTAT & SDHC_PRSSTAT_WTA) == 0) {  // stands at the gap behind the last sector
    SDHC_PROCTL &= ~SDHC_PROCTL_SABGREQ;
    SDHC_PROCTL |= SDHC_PROCTL_CREQ;
  }
  SDHC_PROCTL |= SDHC_PROCTL_SABGREQ;  // stop again at the gap behind this one
  const std::uint32_t start = ARM_DWT_CYCCNT;
  const std::uint32_t limit = kFillBound * (F_CPU_ACTUAL / 1'000'000U);
  for (std::size_t at = 0; at < kSectorSize;) {
    while ((SDHC_PRSSTAT & SDHC_PRSSTAT_BWEN) == 0) {
      if (ARM_DWT_CYCCNT - start > limit) return false;
    }
    for (std::uint32_t i = 0; i < kFifoChunk; ++i, at += sizeof(std::uint32_t)) {
      std::uint32_t word = 0;
      std::memcpy(&word, &sector_[at], sizeof word);
      SDHC_DATPORT = word;
    }
  }
  filled_ = true;
  return true;
}

/// False when the card has told an error of the sector before. Not to be asked while it is busy.
bool SdCard::sectorTaken() {
  if (!filled_) return true;
  filled_ = false;
  const std::uint32_t status = SDHC_IRQSTAT;
  SDHC_IRQSTAT = status;  // writing ones clears them
  return (status & SDHC_IRQSTAT_TC) != 0 && (status & kTransferErrors) == 0;
}

}  // namespace strix
