#include "client_connection.h"

#include "nido/middleware/directory.h"

namespace nido {

Status connect_output(Node& node, const std::string& output_name, const std::string& input_name,
                      double timeout_s) {
  Result<std::unique_ptr<Directory>> directory = Directory::open(node);
  if (!directory) return directory.error();
  const bool found =
      (*directory)
          ->wait([&](const Directory& seen) { return seen.owner_of(input_name).has_value(); }, timeout_s);
  if (!found) {
    return Error{ErrorCode::kNotFound,
                 "no port " + input_name + " within " + std::to_string(timeout_s) + " s"};
  }
  return (*directory)->connect(output_name, input_name, timeout_s);
}

}  // namespace nido
