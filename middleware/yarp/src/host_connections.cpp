// The connections of a host's ports: how they come, what they may keep, how they end.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host.h"
#include "sockets.h"

namespace nido::yarp {
namespace {

std::chrono::steady_clock::duration seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(s));
}

}  // namespace

template <class Connection>
void Host::bury(std::unique_ptr<Connection> connection) {
  connection->let_go();
  // it is still at work: it goes when nobody is
  std::shared_ptr<Connection> shared = std::move(connection);
  loop_.post([shared] {});
}

void Host::on_event(std::uint64_t id, Event event) {
  InConnection& in = *ins_.at(id);
  const auto found = ports_.find(in.port);
  if (found == ports_.end()) return in.finish({});
  std::visit([&](auto& what) { handle(in, found->second, what); }, event);
}

void Host::on_end(std::uint64_t id, const std::string& reason) {
  std::string port_name;
  bool was_reader = false;
  if (const auto in = ins_.find(id); in != ins_.end()) {
    port_name = in->second->port;
    was_reader = in->second->is_reversed;
    bury(std::move(in->second));
    ins_.erase(in);
  } else if (const auto out = outs_.find(id); out != outs_.end()) {
    port_name = out->second->port;
    was_reader = true;
    log_end(*out->second, reason);
    bury(std::move(out->second));
    outs_.erase(out);
  }
  const auto port = ports_.find(port_name);
  if (port == ports_.end()) return;
  port->second.in.erase(id);
  port->second.out.erase(id);
  if (was_reader) tell_readers(port->second);
  tell_writers(port->second);
}

void Host::on_held() {
  if (*held_ <= options_.memory || relieving_) return;
  relieving_ = true;
  std::weak_ptr<Host*> alive = alive_;
  loop_.post([alive] {
    if (const auto self = alive.lock(); self && *self != nullptr) (*self)->relieve();
  });
}

void Host::on_caller(const std::string& name) {
  const auto found = ports_.find(name);
  if (found == ports_.end()) return;
  for (int rounds = 0; rounds < 32; ++rounds) {
    std::string peer;
    Fd fd = accept_tcp(found->second.listener.get(), peer);
    if (!fd.is_open()) return;
    if (ins_.size() + outs_.size() >= options_.connections && !make_room()) {
      note_refusal(name, peer, "there are too many connections");
      continue;
    }
    const std::uint64_t id = ++last_id_;
    auto in = std::make_unique<InConnection>(
        id, loop_, *this, std::move(fd), peer, found->second.spec.limits, found->second.spec.queue,
        std::chrono::steady_clock::now() + seconds(options_.handshake_s), options_.secret);
    in->port = name;
    in->dialect = options_.dialect;
    if (!in->start()) continue;
    found->second.in.insert(id);
    ins_[id] = std::move(in);
  }
}

bool Host::make_room() {
  for (const auto& [id, in] : ins_) {
    if (in->is_opened()) continue;
    end_in(id);
    return true;
  }
  return false;
}

void Host::relieve() {
  relieving_ = false;
  const auto less = [](const auto& a, const auto& b) {
    return a.second->held_bytes() < b.second->held_bytes();
  };
  while (*held_ > options_.memory) {
    const auto in = std::max_element(ins_.begin(), ins_.end(), less);
    const auto out = std::max_element(outs_.begin(), outs_.end(), less);
    const std::size_t in_bytes = in == ins_.end() ? 0 : in->second->held_bytes();
    const std::size_t out_bytes = out == outs_.end() ? 0 : out->second->held_bytes();
    if (in_bytes == 0 && out_bytes == 0) return;
    const auto reason = [&](std::size_t bytes) {
      return fmt::format("all connections together keep more than {} bytes, it keeps most ({})",
                         options_.memory, bytes);
    };
    if (in_bytes >= out_bytes) {
      note_refusal(in->second->port, in->second->peer, reason(in_bytes));
      end_in(in->first);
    } else {
      out->second->end(reason(out_bytes));
    }
  }
}

void Host::end_in(std::uint64_t id) {
  const auto in = ins_.find(id);
  if (in == ins_.end()) return;
  in->second->hang_up("ended");
}

void Host::look_at_clock() {
  const auto now = std::chrono::steady_clock::now();
  std::vector<std::uint64_t> late;
  for (const auto& [id, in] : ins_) {
    if (in->is_late(now)) late.push_back(id);
  }
  for (const std::uint64_t id : late) {
    note_refusal(ins_.at(id)->port, ins_.at(id)->peer, "it said nothing");
    end_in(id);
  }
  late.clear();
  for (const auto& [id, out] : outs_) {
    if (out->is_late(now)) late.push_back(id);
  }
  for (const std::uint64_t id : late) {
    if (const auto out = outs_.find(id); out != outs_.end()) out->second->end("the far side does not answer");
  }
  names_.look_at_clock();
}

void Host::note_refusal(const std::string& port, const std::string& peer, const std::string& reason) {
  ++refused_;
  // a flood of refusals is told once a second
  const auto now = std::chrono::steady_clock::now();
  if (now - told_ < std::chrono::seconds(1)) {
    ++untold_;
    return;
  }
  told_ = now;
  const std::string more = untold_ > 0 ? fmt::format(" (and {} before)", untold_) : "";
  untold_ = 0;
  options_.log(fmt::format("{}: a connection from {} was refused: {}{}", port, peer, reason, more));
}

void Host::log_end(const OutConnection& out, const std::string& reason) {
  if (reason != "asked to" && reason != "the port closes") {
    options_.log(fmt::format("{} to {} ended: {}", out.port, out.target.name, reason));
  }
}

void Host::tell_readers(const HostedPort& port) {
  if (!port.spec.on_readers) return;
  std::size_t readers = 0;
  for (const std::uint64_t id : port.out) readers += outs_.at(id)->is_ready() ? 1 : 0;
  for (const std::uint64_t id : port.in) readers += ins_.at(id)->is_reversed ? 1 : 0;
  port.spec.on_readers(readers);
}

void Host::tell_writers(const HostedPort& port) {
  if (!port.spec.on_writers) return;
  std::size_t writers = 0;
  for (const std::uint64_t id : port.in) {
    const InConnection& in = *ins_.at(id);
    writers += in.is_opened() && !in.is_reversed && in.sender.starts_with('/') ? 1 : 0;
  }
  port.spec.on_writers(writers);
}

void Host::give(const std::string& name, const std::shared_ptr<const Content>& content,
                const std::string& envelope) {
  const auto port = ports_.find(name);
  if (port == ports_.end()) return;
  for (const std::uint64_t id : std::set<std::uint64_t>(port->second.out)) {
    if (const auto out = outs_.find(id); out != outs_.end()) out->second->give(content, envelope);
  }
  for (const std::uint64_t id : std::set<std::uint64_t>(port->second.in)) {
    if (const auto in = ins_.find(id); in != ins_.end() && in->second->is_reversed) {
      in->second->give(content, envelope);
    }
  }
}

void Host::connect_to(const std::string& output, const Contact& contact, Carrier carrier,
                      const std::function<void(Status)>& done) {
  const auto port = ports_.find(output);
  if (port == ports_.end()) return done(Error{ErrorCode::kNotFound, "the port is gone"});
  if (!options_.network && options_.secret.empty() && !is_loopback(contact.host)) {
    return done(Error{ErrorCode::kUnsupported, fmt::format("Cannot connect to {}: {} is not on this computer",
                                                           contact.name, contact.host)});
  }
  if (ins_.size() + outs_.size() >= options_.connections) {
    return done(Error{ErrorCode::kFailed, "there are too many connections"});
  }
  // one connection between two ports
  for (const std::uint64_t id : std::set<std::uint64_t>(port->second.out)) {
    if (outs_.at(id)->target.name == contact.name) outs_.at(id)->end("asked to");
  }
  const std::uint64_t id = ++last_id_;
  auto out = std::make_unique<OutConnection>(
      id, loop_, *this, output, contact, carrier, port->second.spec.queue, options_.dialect,
      std::chrono::steady_clock::now() + seconds(options_.connect_s), options_.secret);
  OutConnection* raw = out.get();
  outs_[id] = std::move(out);
  port->second.out.insert(id);
  raw->start([this, output, done](const Status& status) {
    done(status);
    if (const auto found = ports_.find(output); status && found != ports_.end()) tell_readers(found->second);
  });
}

}  // namespace nido::yarp
