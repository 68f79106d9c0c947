#include "src/heartbeat.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "nido/cli/any_type.h"

namespace nido {

Result<std::unique_ptr<Heartbeat>> Heartbeat::listen(Node& node, std::shared_ptr<Safety> safety,
                                                     std::vector<std::string> sources, double timeout_s) {
  auto directory = Directory::open(node);
  if (!directory) return directory.error();
  std::unique_ptr<Heartbeat> heartbeat(new Heartbeat(node, std::move(safety), std::move(*directory)));
  for (std::string& source : sources) heartbeat->sources_.push_back({std::move(source), nullptr});
  heartbeat->thread_ = std::thread([it = heartbeat.get(), timeout_s] { it->run(timeout_s / 4); });
  return heartbeat;
}

Heartbeat::~Heartbeat() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Heartbeat::run(double interval_s) {
  const auto interval = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(interval_s));
  while (!node_.is_stop_asked()) {
    const auto next = std::chrono::steady_clock::now() + interval;
    for (Source& source : sources_) {
      if (is_heard(source, interval_s)) safety_->beat(source.name);
    }
    std::unique_lock lock(mutex_);
    if (changed_.wait_until(lock, next, [this] { return ends_; })) return;
  }
}

bool Heartbeat::is_heard(Source& source, double patience_s) {
  if (!source.name.starts_with('/')) {
    return directory_->node(source.name) &&
           node_.call("/" + source.name + "/control", "info", patience_s).ok();
  }
  if (!source.input) {
    const auto owner = directory_->owner_of(source.name);
    const AnyType* type = owner ? find_any_type(owner->port.type) : nullptr;
    if (type == nullptr) return false;
    const std::string own =
        fmt::format("/{}/heartbeat{}:i", node_.options().name, source.name.substr(0, source.name.rfind(':')));
    auto input = node_.open_raw_input(own, type->type, Profile::kSensor, 1);
    if (!input || !(*input)->connect(source.name)) return false;
    source.input = std::move(*input);
  }
  return source.input->take_latest().has_value();
}

}  // namespace nido
