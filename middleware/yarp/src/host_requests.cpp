// What comes on the connections of a host's ports, and what is answered.
#include <fmt/format.h>

#include <thread>
#include <utility>

#include "host.h"

namespace nido::yarp {
namespace {

// objects that are long are images and the like: both dialects write them alike
Result<Decoded> decode_cheaply(const std::string& bytes, Dialect preferred) {
  constexpr std::size_t kLongest = 4096;
  if (bytes.size() > kLongest) return Error{};
  return decode_any(bytes, preferred);
}

}  // namespace

void Host::handle(InConnection& in, HostedPort& port, Opened& opened) {
  // a sender that connects again, after a crash perhaps, takes the place of its former connection
  if (opened.sender.starts_with('/')) {
    for (const std::uint64_t id : std::set<std::uint64_t>(port.in)) {
      if (id != in.id && ins_.at(id)->sender == opened.sender) end_in(id);
    }
  }
  in.accept(opened.sender, port.number, options_.host);
  tell_writers(port);
}

void Host::handle(InConnection& in, HostedPort& port, Data& data) {
  const std::uint64_t id = in.id;
  const bool text = is_text(in.stream.carrier());
  if (names_.are_served() && port.number == options_.names_port) return answer_names(in, data);
  if (!port.spec.takes || !port.spec.on_message) {
    std::optional<Bottle> reply;
    if (data.wants_reply) {
      reply =
          Bottle{Value::word("fail"), Value::string(port.spec.name + " gives messages, it does not take any; "
                                                                     "'r' reads it")};
    }
    return in.answer(in.stream.answer(reply, in.dialect));
  }
  // of what is long, and leaves no room for what is short
  constexpr std::size_t kShort = 4096;
  if (data.bytes.size() > kShort && *working_ > options_.memory) {
    note_refusal(port.spec.name, in.peer, "too many bytes wait to be worked on");
    return in.finish({});
  }
  Incoming incoming;
  incoming.held = std::make_shared<const Held>(working_, data.bytes.capacity());
  incoming.bytes = std::move(data.bytes);
  incoming.is_text = text;
  incoming.envelope = std::move(data.envelope);
  incoming.sender = in.sender;
  incoming.wants_reply = data.wants_reply;
  incoming.dialect = in.dialect;
  if (in.stream.carrier() != Carrier::kUdp) incoming.connection = in.token();
  std::weak_ptr<Host*> alive = alive_;
  const bool wants_reply = data.wants_reply;
  // answered here and now, or later from another thread
  incoming.answer = [alive, id, wants_reply, this_thread = std::this_thread::get_id(),
                     loop = &loop_](std::optional<Bottle> reply) {
    auto send = [alive, id, wants_reply, reply = std::move(reply)] {
      const auto self = alive.lock();
      if (self && *self != nullptr) (*self)->answer_message(id, wants_reply ? reply : std::nullopt);
    };
    if (std::this_thread::get_id() == this_thread) {
      send();
    } else {
      loop->post(std::move(send));
    }
  };
  // which dialect this is, for the reply
  if (!text) {
    const Result<Decoded> decoded = decode_cheaply(incoming.bytes, in.dialect);
    if (decoded) in.dialect = decoded->dialect;
  }
  port.spec.on_message(std::move(incoming));
}

void Host::handle(InConnection& in, HostedPort& port, Admin& admin) {
  const bool text = is_text(in.stream.carrier());
  Bottle command;
  if (text) {
    Result<Bottle> parsed = parse_bottle(admin.bytes);
    if (!parsed) return answer_admin(in.id, {Value::word("fail"), Value::string(parsed.error().message)});
    command = std::move(*parsed);
  } else {
    Result<Decoded> decoded = decode_any(admin.bytes, in.dialect);
    if (!decoded) {
      note_refusal(port.spec.name, in.peer, decoded.error().message);
      return in.finish({});
    }
    command = std::move(decoded->bottle);
  }
  const std::uint64_t id = in.id;
  std::weak_ptr<Host*> alive = alive_;
  answer_admin_command(*this, port.spec.name, port.properties, command, [alive, id](Bottle reply) {
    if (const auto self = alive.lock(); self && *self != nullptr) (*self)->answer_admin(id, std::move(reply));
  });
}

void Host::handle(InConnection& in, HostedPort& port, Describe&) {
  in.answer((is_text(in.stream.carrier()) ? describe(*this, port.spec.name) : std::string()) +
            in.stream.answer(std::nullopt, in.dialect));
}

void Host::handle(InConnection& in, HostedPort& port, ShowHelp&) {
  in.answer(
      (is_text(in.stream.carrier()) ? help_for_people(port.spec.name, port.spec.about) : std::string()) +
      in.stream.answer(std::nullopt, in.dialect));
}

void Host::handle(InConnection& in, HostedPort& port, Reverse&) {
  if (!port.spec.gives) return in.answer({});
  in.reverse();
  tell_readers(port);
}

void Host::handle(InConnection& in, HostedPort& port, AddOutput& add) {
  const std::uint64_t id = in.id;
  std::weak_ptr<Host*> alive = alive_;
  const auto say = [alive, id](const std::string& line) {
    const auto self = alive.lock();
    if (!self || *self == nullptr) return;
    if (const auto found = (*self)->ins_.find(id); found != (*self)->ins_.end()) {
      InConnection& connection = *found->second;
      connection.answer(line + "\r\n" + connection.stream.answer(std::nullopt, connection.dialect));
    }
  };
  const std::string name = port.spec.name;
  const std::string target = add.target;
  switch (add.what) {
    case AddOutput::What::kConnect:
      add_output(name, target, {}, [say, name, target](const Status& status) {
        say(status ? "Added connection from " + name + " to " + target : status.error().message);
      });
      return;
    case AddOutput::What::kDisconnectOutput:
      return remove(name, target, true, false, [say, name, target](bool output, bool) {
        say(output ? "Removed connection from " + name + " to " + target
                   : "Could not find an outgoing connection to " + target);
      });
    case AddOutput::What::kDisconnectInput:
      return remove(name, target, false, true, [say, name, target](bool, bool input) {
        say(input ? "Removing connection from " + target + " to " + name
                  : "Could not find an incoming connection from " + target);
      });
  }
}

void Host::handle(InConnection& in, HostedPort&, Quit&) {
  in.finish(in.stream.carrier() == Carrier::kTcp || in.stream.carrier() == Carrier::kTextAck
                ? in.stream.answer(std::nullopt, in.dialect)
                : std::string());
}

void Host::handle(InConnection& in, HostedPort& port, NameRequest& request) {
  if (!names_.are_served() || port.number != options_.names_port) {
    note_refusal(port.spec.name, in.peer, "it asks for names, which are not served on this port");
    return in.finish(std::string(kEndOfAnswer) + "\r\n");
  }
  in.mark_opened();
  in.answer(answer_line(request.line, in.peer));
}

void Host::handle(InConnection& in, HostedPort& port, HttpRequest&) {
  std::string page = describe(*this, port.spec.name) + "\r\n" + port.spec.about + "\r\n";
  in.finish(fmt::format("HTTP/1.0 200 OK\r\nContent-Type: text/plain\r\nContent-Length: {}\r\n\r\n{}",
                        page.size(), page));
}

void Host::handle(InConnection& in, HostedPort& port, Refused& refused) {
  note_refusal(port.spec.name, in.peer, refused.reason);
  in.finish(refused.farewell);
}

void Host::answer_message(std::uint64_t id, const std::optional<Bottle>& reply) {
  const auto in = ins_.find(id);
  if (in == ins_.end()) return;
  in->second->answer(in->second->stream.answer(reply, in->second->dialect));
}

void Host::answer_names(InConnection& in, const Data& data) {
  if (is_text(in.stream.carrier())) {
    const std::string lines = answer_line(data.bytes, in.peer);
    return in.answer(lines + in.stream.answer(std::nullopt, in.dialect));
  }
  Result<Decoded> request = decode_any(data.bytes, in.dialect);
  std::optional<Bottle> reply;
  if (request && is_subscription(request->bottle)) {
    reply = subscribe(request->bottle);
  } else if (data.wants_reply) {
    reply = request ? names_.answer_bottle(request->bottle, in.peer)
                    : Bottle{Value::string("error"), Value::string(request.error().message)};
  }
  in.answer(in.stream.answer(reply, in.dialect));
}

std::string Host::answer_line(const std::string& line, const std::string& peer) {
  const Result<Bottle> words = parse_bottle(line);
  if (!words || !is_subscription(*words)) return names_.answer(line, peer);
  return to_text(subscribe(*words)) + "\r\n" + std::string(kEndOfAnswer) + "\r\n";
}

// "subscribe FROM TO": a connection that the name server is to make, as YARP's programs ask when they follow
// a clock. From an output here, once. "tcp://clock" is /clock.
Bottle Host::subscribe(const Bottle& words) {
  const auto name_of = [](const std::string& contact) {
    const std::size_t colon = contact.find(":/");
    return contact.substr(colon == std::string::npos ? 0 : contact.rfind('/', colon + 2));
  };
  const std::string output = name_of(words[1].text);
  const std::string target = name_of(words[2].text);
  if (!ports_.contains(output)) {
    return {Value::word("fail"), Value::string(output + " is no output here")};
  }
  add_output(output, target, {}, [log = options_.log, output, target](const Status& status) {
    if (!status) log(output + " to " + target + ": " + status.error().message);
  });
  return {Value::word("ok")};
}

void Host::answer_admin(std::uint64_t id, Bottle reply) {
  const auto in = ins_.find(id);
  if (in == ins_.end()) return;
  in->second->answer(in->second->stream.answer(std::move(reply), in->second->dialect));
}

}  // namespace nido::yarp
