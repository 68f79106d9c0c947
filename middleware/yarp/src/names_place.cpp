#include "names_place.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace nido::yarp {
namespace {

// between looks whether the name server still knows us
constexpr auto kLook = std::chrono::seconds(1);

}  // namespace

NamesPlace::NamesPlace(EventLoop& loop, const PortHostOptions& options) : log_(options.log) {
  if (options.names == PortHostOptions::Names::kRegister) {
    client_ =
        std::make_unique<NameClient>(loop, options.names_host.empty() ? options.host : options.names_host,
                                     options.names_port, options.secret);
    return;
  }
  NameRegistry::Options registry;
  registry.host = options.host;
  registry.own_port = options.names_port;
  registry.first_port = options.first_port > 0 ? options.first_port : options.names_port + 2;
  registry.last_port = std::min(65'535, registry.first_port + 20'000);
  own_name_ = registry.own_name;
  registry_.emplace(registry);
}

void NamesPlace::add(const Contact& own) {
  if (registry_) return registry_->add_own(own);
  registered_[own.name] = own;
  enroll(own);
}

void NamesPlace::enroll(const Contact& own) {
  client_->ask(fmt::format("register {} tcp {} {}", own.name, own.host, own.port),
               [this, name = own.name](const Result<std::vector<std::string>>& lines) {
                 if (!lines) log_(fmt::format("{} is not registered: {}", name, lines.error().message));
               });
  for (const std::string& what : {std::string("offers tcp text text_ack udp fast_tcp"),
                                  std::string("accepts tcp text text_ack udp fast_tcp"), "ips " + own.host,
                                  fmt::format("process {}", getpid())}) {
    client_->ask(fmt::format("set {} {}", own.name, what), [](const auto&) {});
  }
}

void NamesPlace::remove(const std::string& name) {
  if (registry_) return registry_->remove_own(name);
  registered_.erase(name);
  client_->ask("unregister " + name, [](const auto&) {});
}

void NamesPlace::find(const std::string& name, std::function<void(std::optional<Contact>)> done) {
  if (registry_) return done(registry_->find(name));
  client_->ask("query " + name, [done = std::move(done)](const Result<std::vector<std::string>>& lines) {
    done(lines && !lines->empty() ? contact_from_line(lines->front()) : std::nullopt);
  });
}

std::string NamesPlace::answer(const std::string& line, const std::string& peer) {
  return registry_->answer(line, peer);
}
Bottle NamesPlace::answer_bottle(const Bottle& request, const std::string& peer) {
  return registry_->answer_bottle(request, peer);
}

void NamesPlace::look_at_clock() {
  if (!client_) return;
  client_->look_at_clock();
  const auto now = std::chrono::steady_clock::now();
  if (registered_.empty() || now - looked_ < kLook) return;
  looked_ = now;
  // a name server that has been started again knows nobody
  client_->ask("query " + registered_.begin()->first, [this](const Result<std::vector<std::string>>& lines) {
    const bool forgotten = lines && (lines->empty() || !contact_from_line(lines->front()));
    if (!forgotten) return;
    for (const auto& [name, own] : registered_) enroll(own);
  });
}

}  // namespace nido::yarp
