#pragma once

#include <string>

namespace nido {

// Text that is safe between tags and inside quoted attributes.
std::string escape_html(const std::string& text);

}  // namespace nido
