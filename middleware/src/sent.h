#pragma once

namespace nido {

// What became of a message that was to be written.
enum class Sent {
  kYes,
  kNoRoom,    // a reader that must get everything is too far behind
  kNoMemory,  // the system gives no shared memory or no open file for it
  kFailed,
};

}  // namespace nido
