#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "lane_loop.h"
#include "name_lock.h"
#include "nido/middleware/node.h"
#include "port_book.h"
#include "reader.h"
#include "writer.h"

namespace nido {

// A text service on DDS as ROS 2 lays it out. Requests are answered one after the other by a thread of its
// own, so that a slow answer holds up nothing else.
class TextService final : public Node::Service, public PortRecord, private ReaderEvents {
 public:
  static Result<std::unique_ptr<TextService>> open(std::shared_ptr<Participant> participant,
                                                   std::shared_ptr<PortBook> book, const std::string& name,
                                                   std::function<std::string(const std::string&)> handler);
  ~TextService() override;

  [[nodiscard]] PortDescription describe() const override;
  void drain_name_lock() override { lock_->drain(); }

 private:
  struct Request {
    std::string text;
    SampleId id;
  };
  TextService() = default;
  void on_message(std::shared_ptr<void> message, const MessageInfo& info) override;
  void answer_requests();

  std::string name_;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<PortBook> book_;
  std::function<std::string(const std::string&)> handler_;
  std::unique_ptr<NameLock> lock_;
  std::unique_ptr<Writer> replies_;
  std::mutex mutex_;
  std::deque<Request> requests_;
  bool closing_ = false;
  std::atomic<std::uint64_t> answered_{0};
  std::shared_ptr<LaneLoop> loop_;  // a thread of its own
  std::unique_ptr<Reader> reader_;
};

// The asking side of one service. Thread-safe.
class TextClient final : private ReaderEvents {
 public:
  static Result<std::shared_ptr<TextClient>> open(std::shared_ptr<Participant> participant,
                                                  const std::string& name);
  ~TextClient() override;
  // See Node::call. `interrupted` is asked about every tenth of a second.
  Result<std::string> call(const std::string& text, double timeout_s,
                           const std::function<bool()>& interrupted);

 private:
  explicit TextClient(std::string name) : name_(std::move(name)) {}
  void on_message(std::shared_ptr<void> message, const MessageInfo& info) override;
  void on_matched(const Guid& writer, bool matched) override;
  void forget(std::uint64_t sequence);
  // a server whose both ends know ours
  [[nodiscard]] bool is_connected() const;

  std::string name_;
  std::shared_ptr<Participant> participant_;
  std::unique_ptr<Writer> requests_;
  std::mutex call_mutex_;  // one writes at a time
  mutable std::mutex mutex_;
  std::shared_ptr<ChangeSignal> changed_;
  std::set<Guid> servers_;
  std::map<std::uint64_t, std::string> answers_;  // by sequence number of the request
  // sequence number of the request, by the number that the answer refers to: (by DDS, that of the request)
  std::map<std::pair<bool, std::uint64_t>, std::uint64_t> awaited_;
  std::unique_ptr<Reader> reader_;
  Guid reply_reader_;
};

}  // namespace nido
