#pragma once

namespace nido::bench {

// A TCP port of 127.0.0.1 that nobody listens at now.
int free_tcp_port();

}  // namespace nido::bench
