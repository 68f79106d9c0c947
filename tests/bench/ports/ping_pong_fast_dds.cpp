// Round trips through Fast DDS by itself.
#include <condition_variable>
#include <mutex>

#include "child.h"
#include "ping_pong.h"
#include "plain_dds.h"

namespace nido::bench {

namespace {

using eprosima::fastrtps::types::ReturnCode_t;
using Message = PlainBytes<kMessage_bytes>;

class Asker final : public PingPong, private dds::DataReaderListener {
 public:
  explicit Asker(int domain) : participant_(domain) {
    writer_ = participant_.writer(participant_.topic<kMessage_bytes>("bench_ping"), 1);
    reader_ = participant_.reader(participant_.topic<kMessage_bytes>("bench_pong"), 1, this);
  }
  static Result<std::unique_ptr<PingPong>> make(int domain) {
    return std::unique_ptr<PingPong>(std::make_unique<Asker>(domain));
  }
  Status connect() override {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < deadline) {
      dds::PublicationMatchedStatus status;
      writer_->get_publication_matched_status(status);
      // the other direction is there when something comes back
      if (status.current_count > 0 && round_trip()) {
        return {};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return Error{ErrorCode::kTimeout, "the answering Fast DDS process did not appear"};
  }
  bool round_trip() override {
    std::unique_lock lock(mutex_);
    has_come_ = false;
    lock.unlock();
    void* message = nullptr;
    if (writer_->loan_sample(message) != ReturnCode_t::RETCODE_OK || !writer_->write(message)) {
      return false;
    }
    lock.lock();
    return come_.wait_for(lock, std::chrono::seconds(1), [&] { return has_come_; });
  }

 private:
  void on_data_available(dds::DataReader* reader) override {
    Message message;
    dds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      const std::lock_guard lock(mutex_);
      has_come_ = true;
    }
    come_.notify_one();
  }

  std::mutex mutex_;
  std::condition_variable come_;
  bool has_come_ = false;
  PlainParticipant participant_;
  dds::DataWriter* writer_ = nullptr;
  dds::DataReader* reader_ = nullptr;
};

class Answerer final : public dds::DataReaderListener {
 public:
  explicit Answerer(int domain) : participant_(domain) {
    writer_ = participant_.writer(participant_.topic<kMessage_bytes>("bench_pong"), 1);
    participant_.reader(participant_.topic<kMessage_bytes>("bench_ping"), 1, this);
  }

 private:
  void on_data_available(dds::DataReader* reader) override {
    Message message;
    dds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      void* answer = nullptr;
      if (writer_->loan_sample(answer) == ReturnCode_t::RETCODE_OK) {
        std::memcpy(answer, &message, sizeof message);
        writer_->write(answer);
      }
    }
  }

  PlainParticipant participant_;
  dds::DataWriter* writer_ = nullptr;
};

Status answer(int domain, const std::string& /*address*/) {
  const Answerer answerer(domain);
  while (hear_parent()) {
  }
  return {};
}

}  // namespace

PingPongKind plain_fast_dds() { return {"plain Fast DDS", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench
