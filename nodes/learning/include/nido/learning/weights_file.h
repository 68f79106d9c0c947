#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "nido/interfaces/result.h"

namespace nido::learning {

// Learned numbers as a small text file that people can read and diff (format: docs/learning.md). Numbers keep
// every bit: what is read equals what was written. A value, thread-compatible.
struct WeightsFile {
  std::string command;                              // the command line that made the file, one line
  std::map<std::string, std::string> notes;         // names without blanks, one line of text each
  std::map<std::string, Eigen::MatrixXd> matrices;  // names without blanks; vectors are one column

  // The file's text. A name with a blank or a text of more lines is a bug and ends the process.
  [[nodiscard]] std::string to_text() const;
  // kInvalidArgument with `origin`, line, what was found and what was expected; also for a number that is not
  // finite.
  static Result<WeightsFile> from_text(const std::string& text, const std::string& origin);

  // Writes to a file beside `path` first and renames it, so that a reader never sees half a file. kFailed
  // with the path.
  [[nodiscard]] Status save(const std::string& path) const;
  // kNotFound if there is no such file; else as from_text.
  static Result<WeightsFile> load(const std::string& path);

  // kInvalidArgument if there is no such matrix, or if its shape is not rows x cols (-1: any).
  [[nodiscard]] Result<Eigen::MatrixXd> matrix(const std::string& name, Eigen::Index rows,
                                               Eigen::Index cols) const;
};

}  // namespace nido::learning
