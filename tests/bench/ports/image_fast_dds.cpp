// Images through Fast DDS by itself: a plain type, loaned and shared.
#include <thread>

#include "image_way.h"
#include "plain_dds.h"

namespace nido::bench {

namespace {

using eprosima::fastrtps::types::ReturnCode_t;
constexpr int kDepth = 4;

class Source final : public ImageSource {
 public:
  explicit Source(int domain) : participant_(domain) {
    writer_ = participant_.writer(participant_.topic<kImage_bytes>("bench_image"), kDepth);
  }
  static Result<std::unique_ptr<ImageSource>> make(int domain) {
    return std::unique_ptr<ImageSource>(std::make_unique<Source>(domain));
  }
  Status connect() override {
    for (int i = 0; i < 4000; ++i) {
      dds::PublicationMatchedStatus status;
      writer_->get_publication_matched_status(status);
      if (status.current_count > 0) return {};
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return Error{ErrorCode::kTimeout, "the receiving Fast DDS process did not appear"};
  }
  void send(const std::function<void(std::uint8_t*)>& fill) override {
    void* place = nullptr;
    if (writer_->loan_sample(place, dds::DataWriter::LoanInitializationKind::NO_LOAN_INITIALIZATION) ==
        ReturnCode_t::RETCODE_OK) {
      fill(static_cast<std::uint8_t*>(place));
      writer_->write(place);
    }
  }

 private:
  PlainParticipant participant_;
  dds::DataWriter* writer_ = nullptr;
};

class Listener final : public dds::DataReaderListener {
 public:
  explicit Listener(const ImageSink& sink) : sink_(sink) {}

 private:
  void on_data_available(dds::DataReader* reader) override {
    FASTDDS_CONST_SEQUENCE(Images, PlainBytes<kImage_bytes>);
    Images images;
    dds::SampleInfoSeq infos;
    while (reader->take(images, infos) == ReturnCode_t::RETCODE_OK) {
      for (dds::LoanableCollection::size_type i = 0; i < images.length(); ++i) {
        if (infos[i].valid_data) sink_(images[i].data);
      }
      reader->return_loan(images, infos);
    }
  }
  const ImageSink& sink_;
};

Status receive(int domain, const std::string& /*address*/, const ImageSink& sink,
               const std::function<void()>& wait) {
  Listener listener(sink);
  PlainParticipant participant(domain);
  participant.reader(participant.topic<kImage_bytes>("bench_image"), kDepth, &listener);
  wait();
  return {};
}

}  // namespace

ImageWay plain_fast_dds_image() { return {"plain Fast DDS, shared and loaned", "", Source::make, receive}; }

}  // namespace nido::bench
