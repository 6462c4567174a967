#include "FileCard.h"

#include <filesystem>

namespace strix {

bool FileCard::sync(std::uint32_t length) {
  if (dead_) return false;
  if (path_.empty()) return true;
  if (file_ == nullptr || std::fflush(file_.get()) != 0) return false;
  std::error_code error;
  std::filesystem::resize_file(path_, length, error);
  return !error;
}

}  // namespace strix
