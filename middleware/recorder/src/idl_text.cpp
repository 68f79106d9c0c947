#include "nido/recorder/idl_text.h"

namespace nido {
namespace {

struct IdlText {
  std::string_view name;
  std::string_view text;
};

#include "idl_text_table.inc"

std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  std::string changed(text);
  for (auto at = changed.find(from); at != std::string::npos; at = changed.find(from, at + to.size())) {
    changed.replace(at, from.size(), to);
  }
  return changed;
}

}  // namespace

std::string_view idl_text_of(std::string_view ros_name) {
  for (const IdlText& one : kIdlTexts) {
    if (one.name == ros_name) return one.text;
  }
  return {};
}

std::vector<std::string_view> idl_types() {
  std::vector<std::string_view> names;
  for (const IdlText& one : kIdlTexts) names.push_back(one.name);
  return names;
}

std::string scoped_name_of(std::string_view ros_name) { return replaced(ros_name, "/", "::"); }
std::string ros_name_of(std::string_view scoped_name) { return replaced(scoped_name, "::", "/"); }

}  // namespace nido
