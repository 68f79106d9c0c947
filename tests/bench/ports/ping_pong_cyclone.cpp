// Round trips through Cyclone DDS, where cyclonedds-dev is installed.
#include "ping_pong.h"

#ifdef NIDO_WITH_CYCLONE
#include <ddsc/dds.h>

#include <cstdlib>

#include "bytes64.h"
#include "child.h"

namespace nido::bench {

namespace {

// A participant with a writer and a reader, on this machine's loopback only.
class Ends {
 public:
  Ends(int domain, const char* out, const char* in, dds_listener_t* listener) {
    constexpr const char* kConfig =
        "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer "
        "address=\"127.0.0.1\"/></Peers></Discovery>";
    domain_ = dds_create_domain(static_cast<dds_domainid_t>(domain), kConfig);
    participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    const dds_entity_t out_topic = dds_create_topic(participant_, &bench_Bytes64_desc, out, nullptr, nullptr);
    const dds_entity_t in_topic = dds_create_topic(participant_, &bench_Bytes64_desc, in, nullptr, nullptr);
    writer = dds_create_writer(participant_, out_topic, qos, nullptr);
    reader = dds_create_reader(participant_, in_topic, qos, listener);
    dds_delete_qos(qos);
  }
  ~Ends() {
    dds_delete(participant_);
    dds_delete(domain_);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  dds_entity_t writer = 0;
  dds_entity_t reader = 0;

 private:
  dds_entity_t domain_ = 0;
  dds_entity_t participant_ = 0;
};

bool take_one(dds_entity_t reader, bench_Bytes64& message) {
  void* place = &message;
  dds_sample_info_t info;
  return dds_take(reader, &place, &info, 1, 1) == 1 && info.valid_data;
}

class Asker final : public PingPong {
 public:
  explicit Asker(int domain) : ends_(domain, "bench_ping", "bench_pong", nullptr) {
    waitset_ = dds_create_waitset(DDS_CYCLONEDDS_HANDLE);
    condition_ = dds_create_readcondition(ends_.reader, DDS_ANY_STATE);
    dds_waitset_attach(waitset_, condition_, 1);
  }
  ~Asker() override { dds_delete(waitset_); }
  static Result<std::unique_ptr<PingPong>> make(int domain) {
    return std::unique_ptr<PingPong>(std::make_unique<Asker>(domain));
  }
  Status connect() override {
    for (int i = 0; i < 2000; ++i) {
      dds_publication_matched_status_t out{};
      dds_get_publication_matched_status(ends_.writer, &out);
      if (out.current_count > 0 && round_trip()) {
        return {};
      }
      dds_sleepfor(DDS_MSECS(10));
    }
    return Error{ErrorCode::kTimeout, "the answering Cyclone DDS process did not appear"};
  }
  bool round_trip() override {
    if (dds_write(ends_.writer, &message_) != DDS_RETCODE_OK) {
      return false;
    }
    dds_attach_t attached = 0;
    while (!take_one(ends_.reader, message_)) {
      if (dds_waitset_wait(waitset_, &attached, 1, DDS_SECS(1)) <= 0) {
        return false;
      }
    }
    return true;
  }

 private:
  Ends ends_;
  dds_entity_t waitset_ = 0;
  dds_entity_t condition_ = 0;
  bench_Bytes64 message_{};
};

Status answer(int domain, const std::string& /*address*/) {
  dds_entity_t writer = 0;
  dds_listener_t* listener = dds_create_listener(&writer);
  dds_lset_data_available(listener, [](dds_entity_t reader, void* to) {
    bench_Bytes64 message;
    while (take_one(reader, message)) {
      dds_write(*static_cast<dds_entity_t*>(to), &message);
    }
  });
  const Ends ends(domain, "bench_pong", "bench_ping", nullptr);
  writer = ends.writer;
  dds_set_listener(ends.reader, listener);
  while (hear_parent()) {
  }
  dds_set_listener(ends.reader, nullptr);
  dds_delete_listener(listener);
  return {};
}

}  // namespace

PingPongKind cyclone_dds() { return {"Cyclone DDS", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench

#else

namespace nido::bench {

PingPongKind cyclone_dds() {
  return {
      "Cyclone DDS", "rtt", "not built in: packages cyclonedds-dev, cyclonedds-tools were not there", {}, {}};
}

}  // namespace nido::bench

#endif
