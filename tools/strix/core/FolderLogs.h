/// The logs of a folder, as the console asks for those of the card (lib/Console/LogTransfer.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace strix {

/// Files named as on the card: log_0001.ulg and up.
class FolderLogs {
 public:
  explicit FolderLogs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::size_t logCount() {
    logs_.clear();
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
      const std::string name = entry.path().filename().string();
      if (name.size() != 12 || name.rfind("log_", 0) != 0 || entry.path().extension() != ".ulg") {
        continue;
      }
      const auto number = static_cast<std::uint32_t>(std::strtoul(&name[4], nullptr, 10));
      logs_.push_back({number, static_cast<std::uint32_t>(entry.file_size(error)), entry.path()});
    }
    std::sort(logs_.begin(), logs_.end(),
              [](const Log& a, const Log& b) { return a.number < b.number; });
    return logs_.size();
  }

  [[nodiscard]] bool logInfo(std::size_t i, std::uint32_t& number, std::uint32_t& bytes) const {
    if (i >= logs_.size()) return false;
    number = logs_[i].number;
    bytes = logs_[i].bytes;
    return true;
  }

  [[nodiscard]] std::size_t readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
                                    std::size_t most) const {
    for (const Log& log : logs_) {
      if (log.number != number) continue;
      std::ifstream file(log.path, std::ios::binary);
      file.seekg(offset);
      file.read(reinterpret_cast<char*>(out), static_cast<std::streamsize>(most));
      return static_cast<std::size_t>(file.gcount());
    }
    return 0;
  }

 private:
  struct Log {
    std::uint32_t number;
    std::uint32_t bytes;
    std::filesystem::path path;
  };

  std::filesystem::path folder_;
  std::vector<Log> logs_;
};

}  // namespace strix
