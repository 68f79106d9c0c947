#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

namespace nido::sim {

// The frame of the world port is the old simulator's: x to the robot's left, y up, z forward, origin on the
// floor.
[[nodiscard]] Eigen::Isometry3d X_WorldPort();

// Words of one line. Quotes keep words together, brackets count as spaces.
struct Words {
  std::vector<std::string> words;
  std::string trouble;  // why the line cannot be read; empty: it can
};
[[nodiscard]] Words split_words(const std::string& line);

// Hands out the words of a command one after another. The first failure stays: later calls give fallbacks.
class Arguments {
 public:
  explicit Arguments(std::vector<std::string> words) : words_(std::move(words)) {}

  [[nodiscard]] bool done() const { return next_ >= words_.size(); }
  [[nodiscard]] std::size_t left() const { return words_.size() - next_; }
  [[nodiscard]] const std::string& peek(std::size_t ahead = 0) const;
  void skip(std::size_t count = 1) { next_ += count; }

  // The next word; `what` names it in failures.
  std::string word(const char* what);
  // The next word as a finite number within the bounds. `reason` is the old simulator's word for the failure.
  double number(const char* reason, const char* what, double lowest, double highest);
  Eigen::Vector3d vector(const char* reason, const char* what, double lowest, double highest);
  int index(const char* what);
  // 0, 1, false, true; the fallback when no word is left.
  bool flag(const char* what, bool fallback);
  // Complains about words that are left, and says how the line should be.
  void end();
  void set_usage(std::string usage) { usage_ = std::move(usage); }

  void fail(const std::string& reason, const std::string& detail = {});
  [[nodiscard]] bool ok() const { return reply_.empty(); }
  [[nodiscard]] const std::string& failure() const { return reply_; }

 private:
  std::vector<std::string> words_;
  std::size_t next_ = 0;
  std::string reply_;
  std::string usage_;  // empty: unknown
};

// `[fail] "reason" "detail"`
[[nodiscard]] std::string fail_reply(const std::string& reason, const std::string& detail);
// Numbers as short as they stay exact to a micrometre.
[[nodiscard]] std::string number_text(double value);
[[nodiscard]] std::string vector_text(const Eigen::Vector3d& v);
// In quotes when it has spaces.
[[nodiscard]] std::string name_text(const std::string& name);

}  // namespace nido::sim
