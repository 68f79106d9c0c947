#pragma once

#include <optional>
#include <string>

#include "nido/speech/phrases.h"

namespace nido {

// Listens for lessons: a person names a thing ("this is a plum") and says next what to do with it ("drop plum
// into basket"). From then on the bare name asks for that. A value, thread-compatible.
class LessonListener {
 public:
  // Every text that was understood, in turn. The order that ends a lesson, if it is one.
  std::optional<Order> hear(const std::string& text, const PhraseBook& book);

 private:
  std::string named_;  // just now; empty: none
};

}  // namespace nido
