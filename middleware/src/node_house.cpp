// The housekeeping of a node: its announcements, its published log, complaints about its wiring.

#include <unistd.h>

#include <chrono>

#include "nido/middleware/typed_port.h"
#include "node_impl.h"

namespace nido {

namespace {

using Steady = std::chrono::steady_clock;

msgs::PortInfo to_message(const PortDescription& port) {
  msgs::PortInfo message;
  message.name(port.name);
  message.type(port.type);
  message.direction(port.direction);
  message.profile(port.profile);
  message.written(port.written);
  for (const ConnectionCounters& connection : port.connections) {
    msgs::ConnectionInfo info;
    info.source(connection.source);
    info.live(connection.live);
    info.received(connection.received);
    info.lost(connection.lost);
    info.bytes(connection.bytes);
    message.connections().push_back(std::move(info));
  }
  return message;
}

}  // namespace

void NodeImpl::announce() {
  msgs::NodeInfo info;
  info.name(options_.name);
  info.pid(static_cast<std::uint32_t>(getpid()));
  info.host(host_name());
  {
    const std::lock_guard lock(mutex_);
    info.state(state_);
    info.detail(detail_);
    for (const auto& [key, parameter] : parameters_) {
      info.parameters().push_back(key + " = " + parameter.description.value);
    }
  }
  if (!restarts_.empty()) {
    info.parameters().push_back("restarts = " + restarts_);
  }
  book_->each_port([&](PortRecord& port) { info.ports().push_back(to_message(port.describe())); });
  info_writer_->write(&info);
}

void NodeImpl::keep_house() {
  // at most fifty announcements a second when much changes, at least one when nothing does
  constexpr auto kLeast = std::chrono::milliseconds(20);
  constexpr auto kMost = std::chrono::seconds(1);
  for (;;) {
    const std::uint64_t seen = book_->changes()->count();
    const bool is_last = closing_.load();
    lock_->drain();
    book_->each_port([&](PortRecord& port) { port.drain_name_lock(); });
    std::vector<std::string> complaints;
    book_->each_input([&](InputRecord& port) {
      for (std::string& text : port.new_complaints()) {
        complaints.push_back(std::move(text));
      }
    });
    for (const std::string& text : complaints) {
      log_.add(now(), NodeLog::Level::kWarning, text);
    }
    const auto lines = log_.take_unpublished();
    if (!options_.hidden) {
      for (const NodeLog::Line& line : lines) {
        msgs::Log message;
        message.header().stamp().sec(static_cast<std::int32_t>(line.time.ns / 1'000'000'000));
        message.header().stamp().nanosec(static_cast<std::uint32_t>(line.time.ns % 1'000'000'000));
        message.node(options_.name);
        message.level(static_cast<std::uint8_t>(line.level));
        message.text(line.text);
        log_writer_->write(&message);
      }
      announce();
    }
    if (is_last) {
      return;
    }
    const auto wall = Steady::now();
    while (!closing_.load() && Steady::now() < wall + kLeast) {
      const std::uint64_t count = book_->changes()->count();
      if (!closing_.load()) {
        book_->changes()->wait_until(count, wall + kLeast);
      }
    }
    book_->changes()->wait_until(seen, wall + kMost);
  }
}

}  // namespace nido
