/// Reads the CSV files in sim_vectors/: a comment line, a line of column names, rows of numbers.
#pragma once

#include <unity.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace strix {

/// The folder that tools/matlab writes. Tests run in the project's folder, or name it in
/// STRIX_ROOT.
inline std::string vectorFolder() {
  const char* root = std::getenv("STRIX_ROOT");
  return std::string(root == nullptr ? "." : root) + "/sim_vectors/";
}

class VectorFile {
 public:
  /// @param file  below sim_vectors/, as "flight/inputs.csv"
  explicit VectorFile(const std::string& file) {
    std::ifstream in(vectorFolder() + file);
    std::string line;
    bool named = false;
    while (std::getline(in, line)) {
      if (line.empty() || line[0] == '#') continue;
      if (!named) {
        header_ = line;
        named = true;
        for (std::size_t i = 0; i <= line.size();) {
          std::size_t end = line.find(',', i);
          if (end == std::string::npos) end = line.size();
          names_.push_back(line.substr(i, end - i));
          i = end + 1;
        }
        continue;
      }
      std::vector<double> row;
      row.reserve(names_.size());
      const char* at = line.c_str();
      if (header_ == "name,value") {  // config.csv: the first column is text
        const std::size_t comma = line.find(',');
        labels_.push_back(line.substr(0, comma));
        at += comma + 1;
      }
      for (;;) {
        char* end = nullptr;
        row.push_back(std::strtod(at, &end));
        if (end == at || *end == '\0') break;
        at = end + 1;
      }
      rows_.push_back(row);
    }
  }

  [[nodiscard]] bool empty() const { return rows_.empty(); }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] const std::vector<double>& row(std::size_t i) const { return rows_[i]; }

  /// Index of a column; a name that is not there fails the test.
  [[nodiscard]] std::size_t column(const std::string& name) const { return indexOf(names_, name); }

  /// The value of a name,value row; a name that is not there fails the test.
  [[nodiscard]] double value(const std::string& name) const {
    return rows_[indexOf(labels_, name)][0];
  }

 private:
  static std::size_t indexOf(const std::vector<std::string>& names, const std::string& name) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) return i;
    }
    TEST_FAIL_MESSAGE(("sim_vectors: nothing is named " + name).c_str());
    return 0;
  }

  std::string header_;
  std::vector<std::string> names_;
  std::vector<std::string> labels_;
  std::vector<std::vector<double>> rows_;
};

/// Leaves a test where the vectors are missing.
inline void needVectors(const VectorFile& file) {
  if (file.empty()) TEST_IGNORE_MESSAGE("no sim_vectors/ here: run `make vectors`");
}

}  // namespace strix
