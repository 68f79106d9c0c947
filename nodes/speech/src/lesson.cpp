#include "nido/speech/lesson.h"

#include <utility>

namespace nido {

std::optional<Order> LessonListener::hear(const std::string& text, const PhraseBook& book) {
  if (text.starts_with(kNaming)) {
    named_ = text.substr(std::string_view(kNaming).size());
    return std::nullopt;
  }
  const std::string named = std::exchange(named_, "");
  auto order = book.order_in(text);
  if (named.empty() || !order || order->name != named || order->verb == Verb::kLook) return std::nullopt;
  return order;
}

}  // namespace nido
