#include "world_text.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "nido/simulator/simulation.h"

namespace nido::sim {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr double kRootBehindOrigin_m = 0.026;

// what a person typed, safe to repeat in a reply
std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 60)) out += (c == '"' || static_cast<unsigned char>(c) < 32) ? '?' : c;
  return out;
}

}  // namespace

Eigen::Isometry3d X_WorldPort() {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() << 0, 0, -1, -1, 0, 0, 0, 1, 0;
  X.translation() = Eigen::Vector3d(-kRootBehindOrigin_m, 0, Simulation::kFloorHeight_m);
  return X;
}

Words split_words(const std::string& line) {
  Words out;
  if (line.size() > kLongestLine) {
    out.trouble = "a line has at most " + std::to_string(kLongestLine) + " characters";
    return out;
  }
  std::string word;
  bool inside = false;
  bool any = false;
  for (const char c : line) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 32 && c != '\t' && c != '\n' && c != '\r') {
      out.trouble = "the line holds a control character (code " + std::to_string(code) + ")";
      return out;
    }
    if (c == '"') {
      inside = !inside;
      any = true;
    } else if (!inside && std::string_view(" \t\n\r()[]").find(c) != std::string_view::npos) {
      if (any) out.words.push_back(word);
      word.clear();
      any = false;
    } else {
      word += c;
      any = true;
    }
  }
  if (inside) out.trouble = "a quote is not closed";
  if (any) out.words.push_back(word);
  return out;
}

const std::string& Arguments::peek(std::size_t ahead) const {
  static const std::string kNone;
  return next_ + ahead < words_.size() ? words_[next_ + ahead] : kNone;
}

std::string Arguments::word(const char* what) {
  if (!ok()) return {};
  if (done()) {
    fail("too few words", std::string(what) + " is missing");
    return {};
  }
  return words_[next_++];
}

double Arguments::number(const char* reason, const char* what, double lowest, double highest) {
  if (!ok()) return lowest;
  if (done()) {
    fail(reason, std::string(what) + " is missing");
    return lowest;
  }
  const std::string& text = words_[next_];
  double value = 0;
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(begin, end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) {
    fail(reason, std::string(what) + " is \"" + printable(text) + "\", not a number (word " +
                     std::to_string(next_ + 1) + ")");
    return lowest;
  }
  if (value < lowest || value > highest) {
    fail(reason, std::string(what) + " is " + number_text(value) + "; allowed are " + number_text(lowest) +
                     " to " + number_text(highest));
    return lowest;
  }
  ++next_;
  return value;
}

Eigen::Vector3d Arguments::vector(const char* reason, const char* what, double lowest, double highest) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::string(what) + " " + "xyz"[i];
    v[i] = number(reason, name.c_str(), lowest, highest);
  }
  return v;
}

int Arguments::index(const char* what) {
  const double value = number("could not set index", what, 1, 1e6);
  if (ok() && value != std::floor(value))
    fail("could not set index", std::string(what) + " must be a whole number");
  return static_cast<int>(value);
}

bool Arguments::flag(const char* what, bool fallback) {
  if (!ok() || done()) return fallback;
  const std::string text = word(what);
  if (text == "1" || text == "true") return true;
  if (text == "0" || text == "false") return false;
  fail("could not set collide", std::string(what) + " is \"" + printable(text) + "\"; allowed are 0 and 1");
  return fallback;
}

void Arguments::end() {
  if (ok() && !done()) {
    fail("too many words",
         "\"" + printable(words_[next_]) + "\" is one too many" + (usage_.empty() ? "" : "; say " + usage_));
  }
}

void Arguments::fail(const std::string& reason, const std::string& detail) {
  if (reply_.empty()) reply_ = fail_reply(reason, detail);
}

std::string fail_reply(const std::string& reason, const std::string& detail) {
  std::string reply = "[fail] \"" + reason + "\"";
  if (detail.empty()) return reply;
  std::string plain;
  for (const char c : detail) plain += c == '"' ? '\'' : c;
  return reply + " \"" + plain + "\"";
}

std::string number_text(double value) {
  if (std::abs(value) < 5e-7) return "0.0";
  std::array<char, 32> text{};
  constexpr double kLongestWritten = 1e15;
  if (std::abs(value) >= kLongestWritten) {
    std::snprintf(text.data(), text.size(), "%g", value);
    return text.data();
  }
  std::snprintf(text.data(), text.size(), "%.6f", value);
  std::string out = text.data();
  while (out.back() == '0' && out[out.size() - 2] != '.') out.pop_back();
  return out;
}

std::string vector_text(const Eigen::Vector3d& v) {
  return number_text(v.x()) + " " + number_text(v.y()) + " " + number_text(v.z());
}

std::string name_text(const std::string& name) {
  return name.find(' ') == std::string::npos ? name : "\"" + name + "\"";
}

}  // namespace nido::sim
