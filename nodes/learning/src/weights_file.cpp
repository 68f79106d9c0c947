#include "nido/learning/weights_file.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string_view>
#include <system_error>

namespace nido::learning {
namespace {

constexpr std::string_view kMagic = "nido-weights 1";
constexpr long kMostElements = 10'000'000;  // a header that asks for more is damaged

void require(bool condition, const std::string& what) {
  if (!condition) {
    std::cerr << "bug: weights file: " << what << '\n';
    std::abort();
  }
}

bool is_name(const std::string& name) {
  return !name.empty() && name.find_first_of(" \t\r\n") == std::string::npos;
}
bool is_line(const std::string& text) { return text.find_first_of("\r\n") == std::string::npos; }

void append_number(std::string& text, double value) {
  char buffer[32];
  const auto end =
      std::to_chars(buffer, buffer + sizeof buffer, value);  // shortest text that reads back equal
  text.append(buffer, end.ptr);
}

// Goes through the lines of a text and knows where it is.
class Lines {
 public:
  Lines(const std::string& text, const std::string& origin) : stream_(text), origin_(origin) {}
  bool next(std::string& line) {
    if (!std::getline(stream_, line)) return false;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    ++number_;
    return true;
  }
  [[nodiscard]] Error error(const std::string& sentence) const {
    return {ErrorCode::kInvalidArgument, origin_ + ":" + std::to_string(number_) + ": " + sentence};
  }

 private:
  std::istringstream stream_;
  std::string origin_;
  int number_ = 0;
};

Result<double> parse_number(std::string_view word, const Lines& lines) {
  double value = 0.0;
  const auto end = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end.ec != std::errc() || end.ptr != word.data() + word.size() || !std::isfinite(value)) {
    return lines.error("'" + std::string(word) + "' found where a finite number was expected");
  }
  return value;
}

Result<Eigen::MatrixXd> parse_matrix(Lines& lines, long rows, long cols, const std::string& name) {
  Eigen::MatrixXd matrix(rows, cols);
  std::string line;
  for (long row = 0; row < rows; ++row) {
    if (!lines.next(line)) {
      return lines.error("the file ends in row " + std::to_string(row) + " of matrix '" + name +
                         "', which has " + std::to_string(rows) + " rows");
    }
    std::istringstream words(line);
    std::string word;
    for (long col = 0; col < cols; ++col) {
      if (!(words >> word)) {
        return lines.error("row " + std::to_string(row) + " of matrix '" + name + "' has " +
                           std::to_string(col) + " numbers, expected " + std::to_string(cols));
      }
      auto value = parse_number(word, lines);
      if (!value) return value.error();
      matrix(row, col) = *value;
    }
    if (words >> word) {
      return lines.error("row " + std::to_string(row) + " of matrix '" + name + "' has more than " +
                         std::to_string(cols) + " numbers");
    }
  }
  return matrix;
}

}  // namespace

std::string WeightsFile::to_text() const {
  require(is_line(command), "the command has more than one line");
  std::string text(kMagic);
  text += "\ncommand " + command + "\n";
  for (const auto& [name, note] : notes) {
    require(is_name(name) && is_line(note), "note '" + name + "'");
    text += "note " + name + " " + note + "\n";
  }
  for (const auto& [name, matrix] : matrices) {
    require(is_name(name) && matrix.size() > 0 && matrix.allFinite(), "matrix '" + name + "'");
    text +=
        "matrix " + name + " " + std::to_string(matrix.rows()) + " " + std::to_string(matrix.cols()) + "\n";
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      for (Eigen::Index col = 0; col < matrix.cols(); ++col) {
        if (col > 0) text += ' ';
        append_number(text, matrix(row, col));
      }
      text += '\n';
    }
  }
  text += "end\n";
  return text;
}

Result<WeightsFile> WeightsFile::from_text(const std::string& text, const std::string& origin) {
  Lines lines(text, origin);
  std::string line;
  if (!lines.next(line) || line != kMagic) {
    return lines.error("'" + line.substr(0, 40) + "' found where '" + std::string(kMagic) +
                       "' was expected; this is no weights file of this version");
  }
  WeightsFile file;
  if (!lines.next(line) || line.rfind("command ", 0) != 0) {
    return lines.error("expected the line 'command ...' with the command that made the file");
  }
  file.command = line.substr(8);
  while (lines.next(line)) {
    if (line == "end") {
      while (lines.next(line)) {
        if (!line.empty()) return lines.error("text after the line 'end'");
      }
      return file;
    }
    std::istringstream words(line);
    std::string kind;
    std::string name;
    words >> kind >> name;
    if (name.empty() || (kind != "note" && kind != "matrix")) {
      return lines.error("'" + line.substr(0, 40) +
                         "' found where 'note NAME ...', 'matrix NAME ROWS COLS' or 'end' "
                         "was expected");
    }
    if (kind == "note") {
      std::string note;
      std::getline(words >> std::ws, note);
      if (!file.notes.emplace(name, note).second)
        return lines.error("note '" + name + "' stands here a second time");
      continue;
    }
    long rows = 0;
    long cols = 0;
    std::string rest;
    if (!(words >> rows >> cols) || rows <= 0 || cols <= 0 || rows > kMostElements / cols ||
        (words >> rest)) {
      return lines.error("'" + line.substr(0, 40) + "' found where 'matrix NAME ROWS COLS' was expected");
    }
    auto matrix = parse_matrix(lines, rows, cols, name);
    if (!matrix) return matrix.error();
    if (!file.matrices.emplace(name, std::move(*matrix)).second) {
      return lines.error("matrix '" + name + "' stands here a second time");
    }
  }
  return lines.error("the file ends without the line 'end': it is cut off");
}

Status WeightsFile::save(const std::string& path) const {
  const std::string draft = path + ".new";
  {
    std::ofstream stream(draft, std::ios::binary | std::ios::trunc);
    stream << to_text();
    stream.flush();
    if (!stream)
      return Error{ErrorCode::kFailed, draft + ": cannot be written; check the folder and its rights"};
  }
  std::error_code failure;
  std::filesystem::rename(draft, path, failure);
  if (failure) return Error{ErrorCode::kFailed, path + ": cannot be written: " + failure.message()};
  return {};
}

Result<WeightsFile> WeightsFile::load(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return Error{ErrorCode::kNotFound, path + ": no such weights file (or no right to read it)"};
  std::ostringstream text;
  text << stream.rdbuf();
  return from_text(text.str(), path);
}

Result<Eigen::MatrixXd> WeightsFile::matrix(const std::string& name, Eigen::Index rows,
                                            Eigen::Index cols) const {
  const auto found = matrices.find(name);
  if (found == matrices.end()) {
    return Error{ErrorCode::kInvalidArgument, "no matrix '" + name + "' among the weights"};
  }
  const Eigen::MatrixXd& matrix = found->second;
  if ((rows >= 0 && matrix.rows() != rows) || (cols >= 0 && matrix.cols() != cols)) {
    const auto expected = [](Eigen::Index n) { return n < 0 ? std::string("any") : std::to_string(n); };
    return Error{ErrorCode::kInvalidArgument, "matrix '" + name + "' is " + std::to_string(matrix.rows()) +
                                                  " x " + std::to_string(matrix.cols()) + ", expected " +
                                                  expected(rows) + " x " + expected(cols)};
  }
  return matrix;
}

}  // namespace nido::learning
