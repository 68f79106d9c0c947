#pragma once

#include <map>
#include <set>

#include "admin.h"
#include "connections.h"
#include "names_place.h"
#include "nido/yarp/port_host.h"

namespace nido::yarp {

// Ports and their connections on one event loop; port_host.h says what they do. What belongs to ports is in
// port_host.cpp, what to connections in host_connections.cpp, what is asked on them in host_requests.cpp.
class Host final : public PortHost, public ConnectionOwner, public AdminActions {
 public:
  Host(EventLoop& loop, PortHostOptions options)
      : loop_(loop),
        options_(std::move(options)),
        alive_(std::make_shared<Host*>(this)),
        names_(loop_, options_) {}
  ~Host() override;
  Status start();

  // PortHost
  Status open_port(PortSpec spec) override;
  void close_port(const std::string& name) override;
  int number_of(const std::string& name) const override;
  void publish(const std::string& name, std::shared_ptr<const Content> content,
               std::string envelope) override;
  void connect(const std::string& output, const std::string& target, Carrier carrier,
               std::function<void(Status)> done) override;
  void find(const std::string& name, std::function<void(std::optional<Contact>)> done) override;
  Figures figures() const override;
  bool has_port(const std::string& name) const override { return ports_.contains(name); }

  // ConnectionOwner
  void on_event(std::uint64_t id, Event event) override;
  void on_end(std::uint64_t id, const std::string& reason) override;
  // not now: the connection that grew is still at work
  void on_held() override;
  void on_lost(std::size_t messages) override { lost_ += messages; }
  HeldTotal held_total() const override { return held_; }

  // AdminActions
  std::vector<Route> routes(const std::string& port_name, bool outgoing) const override;
  std::string address_of(const std::string& port_name) const override;
  void add_output(const std::string& port_name, const std::string& given, const std::string& given_carrier,
                  std::function<void(Status)> done) override;
  void remove(const std::string& port_name, const std::string& target, bool outputs, bool inputs,
              std::function<void(bool output, bool input)> done) override;
  bool gives(const std::string& port_name) const override { return ports_.at(port_name).spec.gives; }
  bool takes(const std::string& port_name) const override { return ports_.at(port_name).spec.takes; }

 private:
  struct HostedPort {
    PortSpec spec;
    Fd listener;
    int number = 0;
    std::set<std::uint64_t> in;   // connections that somebody made
    std::set<std::uint64_t> out;  // connections that we made
    std::map<std::string, Bottle> properties;
  };

  Status open_listener(PortSpec spec, int number);

  void on_caller(const std::string& name);
  // ends the oldest connection that has not said yet what it wants; false when all have
  bool make_room();
  // ends the connections that keep most until the others have room
  void relieve();
  void end_in(std::uint64_t id);
  void look_at_clock();
  void note_refusal(const std::string& port, const std::string& peer, const std::string& reason);
  void log_end(const OutConnection& out, const std::string& reason);
  template <class Connection>
  void bury(std::unique_ptr<Connection> connection);
  void tell_readers(const HostedPort& port);
  // connections with a port's name: people and tools that only ask have none
  void tell_writers(const HostedPort& port);
  void give(const std::string& name, const std::shared_ptr<const Content>& content,
            const std::string& envelope);
  void connect_to(const std::string& output, const Contact& contact, Carrier carrier,
                  const std::function<void(Status)>& done);

  // What comes on a connection.
  void handle(InConnection& in, HostedPort& port, Opened& opened);
  void handle(InConnection& in, HostedPort& port, Data& data);
  void handle(InConnection& in, HostedPort& port, Admin& admin);
  void handle(InConnection& in, HostedPort& port, Describe&);
  void handle(InConnection& in, HostedPort& port, ShowHelp&);
  void handle(InConnection& in, HostedPort& port, Reverse&);
  void handle(InConnection& in, HostedPort& port, AddOutput& add);
  void handle(InConnection& in, HostedPort&, Quit&);
  void handle(InConnection& in, HostedPort& port, NameRequest& request);
  void handle(InConnection& in, HostedPort& port, HttpRequest&);
  void handle(InConnection& in, HostedPort& port, Refused& refused);
  void answer_message(std::uint64_t id, const std::optional<Bottle>& reply);
  void answer_names(InConnection& in, const Data& data);
  std::string answer_line(const std::string& line, const std::string& peer);
  static bool is_subscription(const Bottle& words) {
    return words.size() >= 3 && words[0].is_word("subscribe") && words[1].is_text() && words[2].is_text();
  }
  Bottle subscribe(const Bottle& words);
  void answer_admin(std::uint64_t id, Bottle reply);

  EventLoop& loop_;
  PortHostOptions options_;
  std::shared_ptr<Host*> alive_;
  NamesPlace names_;
  std::map<std::string, HostedPort> ports_;
  std::map<std::uint64_t, std::unique_ptr<InConnection>> ins_;
  std::map<std::uint64_t, std::unique_ptr<OutConnection>> outs_;
  std::uint64_t last_id_ = 0;
  int next_number_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t lost_ = 0;
  const HeldTotal held_ = std::make_shared<std::atomic<std::size_t>>(0);     // by connections
  const HeldTotal working_ = std::make_shared<std::atomic<std::size_t>>(0);  // by messages that are worked on
  bool relieving_ = false;
  SteadyTime told_;
  std::uint64_t untold_ = 0;
};

}  // namespace nido::yarp
