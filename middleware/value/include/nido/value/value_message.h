#pragma once

#include "nido/msgs/types.h"
#include "nido/value/value.h"

namespace nido {

// What a port of msgs::Values carries (docs/values.md):
//
//     auto out = node.open_output<msgs::Values>("/counter/report:o", Profile::kEvent);
//     (void)(*out)->write(message_of({Value::word("seen"), Value::of(3), Value::string("blue cube")}));
//
//     auto in = node.open_input<msgs::Values>("/counter/report:i", Profile::kEvent);
//     if (auto message = (*in)->take()) {
//       if (const Result<Values> values = values_of(*message)) { ... }
//     }

// The header's stamp is 0 unless it is set afterwards.
[[nodiscard]] msgs::Values message_of(const Values& values);
// No bytes are the empty list. kInvalidArgument: the bytes are no list, or one beyond the limits; the
// sentence tells where.
Result<Values> values_of(const msgs::Values& message, const ValueLimits& limits = {});

}  // namespace nido
