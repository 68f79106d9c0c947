#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "nido/cli/any_type.h"
#include "nido/interfaces/result.h"

namespace nido {

// A type of OMG IDL, as far as messages need it.
struct IdlType {
  enum class Kind {
    kBool,
    kInt8,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kInt64,
    kUint64,
    kFloat,
    kDouble,
    kString,
    kEnum,  // a 32-bit number on the wire
    kStruct,
    kSequence,
    kArray
  };
  struct Field {
    std::string name;
    std::shared_ptr<const IdlType> type;
  };
  Kind kind = Kind::kStruct;
  std::string name;                     // of structs and enums, as ROS 2 has it: "sensor_msgs/msg/Image"
  std::vector<Field> fields;            // of structs
  std::vector<std::string> words;       // of enums, by number
  std::shared_ptr<const IdlType> item;  // of sequences and arrays
  std::size_t size = 0;                 // of arrays; the bound of sequences and strings, 0: none
};

// Message types that are known by their definition only: what a node that was built elsewhere sends.
class IdlTypes {
 public:
  // Adds the structs of a text: modules, structs, enums, typedefs, constants; basic types, string, sequence,
  // arrays. Annotations and preprocessor lines are passed over: files that one includes are added before.
  // kInvalidArgument gives the line, what was found and what is expected; nothing is added then.
  Status add(std::string_view text);
  // The definition; nullptr if it was not given. "pkg/msg/Type".
  [[nodiscard]] std::shared_ptr<const IdlType> definition(const std::string& ros_name) const;
  // The same as a type that tools read and write; the message is a RawMessage (raw_message.h). nullptr if it
  // was not given.
  [[nodiscard]] std::shared_ptr<const AnyType> find(const std::string& ros_name) const;

 private:
  std::map<std::string, std::shared_ptr<const IdlType>>
      types_;  // by ROS 2 name, also those that are no messages
};

// A message on the wire (CDR or plain CDR2, either byte order) as JSON; sequences of more than `longest`
// items are cut as AnyType::to_json does. kInvalidArgument: these bytes are no such message.
Result<Json> json_of_cdr(const IdlType& type, std::string_view bytes, std::size_t longest = 0);
// The way back, little-endian CDR: fields that are not named are 0 or empty. kInvalidArgument names the
// field, what was found and what is expected.
Result<std::string> cdr_of_json(const IdlType& type, const Json& value);

}  // namespace nido
