#pragma once

// From a message to what DDS needs to carry it. Heavy: for the .cpp files that open ports only.

#include "nido/msgs/idl/nidoPubSubTypes.h"
#include "nido/msgs/idl/stdPubSubTypes.h"
#include "nido/msgs/types.h"

namespace nido::msgs {

// TypeSupportOf<Image>::type is the class that serializes an Image.
template <class T>
struct TypeSupportOf;

#define NIDO_MSGS_SUPPORT(package, folder, name)           \
  template <>                                              \
  struct TypeSupportOf<package::folder::dds_::name##_> {   \
    using type = package::folder::dds_::name##_PubSubType; \
  };
NIDO_MSGS(NIDO_MSGS_SUPPORT)
#undef NIDO_MSGS_SUPPORT

}  // namespace nido::msgs
