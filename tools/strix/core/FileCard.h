/// The log's block device on a laptop: an ordinary file.
#pragma once

#include <BlockDevice.h>

#include <cstdio>
#include <memory>
#include <string>

namespace strix {

/// Busy and broken only when it is told to be, as a card that stalls or dies. The file ends where
/// the last sync said it does, as the card's would. Without a path it takes everything and keeps
/// nothing.
class FileCard {
 public:
  explicit FileCard(const std::string& path)
      : path_(path), file_(path.empty() ? nullptr : std::fopen(path.c_str(), "wb+")) {}

  /// False when the file could not be made; errno says why.
  [[nodiscard]] bool open() const { return path_.empty() || file_ != nullptr; }

  [[nodiscard]] bool busy() const { return stalled_; }

  [[nodiscard]] bool writeSector(std::uint32_t index, const std::uint8_t (&data)[kSectorSize]) {
    if (dead_) return false;
    if (file_ == nullptr) return path_.empty();
    const long offset = static_cast<long>(index) * static_cast<long>(kSectorSize);
    return std::fseek(file_.get(), offset, SEEK_SET) == 0 &&
           std::fwrite(data, 1, kSectorSize, file_.get()) == kSectorSize;
  }

  [[nodiscard]] bool sync(std::uint32_t length);

  // The outside.
  void setStalled(bool stalled) { stalled_ = stalled; }  ///< it takes no sector until told again
  void setDead(bool dead) { dead_ = dead; }              ///< it fails whatever it is asked

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  bool stalled_ = false;
  bool dead_ = false;
};

}  // namespace strix
