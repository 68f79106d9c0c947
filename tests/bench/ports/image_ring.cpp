// Images through a ring in shared memory, and through a Unix socket, with nothing around them: what the
// machine itself takes.
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <thread>

#include "child.h"
#include "image_way.h"
#include "unix_address.h"

namespace nido::bench {

namespace {

constexpr std::uint32_t kSlots = 4;

struct Ring {
  std::atomic<std::uint32_t> written;  // images so far; the futex
  std::atomic<std::uint32_t> is_read;  // a reader is there
  std::array<std::uint8_t, 4096 - 8> padding;
  std::array<std::array<std::uint8_t, kImage_bytes>, kSlots> slots;
};

void futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  syscall(SYS_futex, &word, operation, value, nullptr, nullptr, 0);
}

Ring* map_ring(int fd) {
  void* place = mmap(nullptr, sizeof(Ring), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  return place == MAP_FAILED ? nullptr : static_cast<Ring*>(place);
}

class RingSource final : public ImageSource {
 public:
  ~RingSource() override {
    if (ring_ != nullptr) munmap(ring_, sizeof(Ring));
    close(fd_);
  }
  static Result<std::unique_ptr<ImageSource>> make(int /*domain*/) {
    auto self = std::make_unique<RingSource>();
    self->fd_ = memfd_create("nido-bench", MFD_CLOEXEC);
    if (self->fd_ < 0 || ftruncate(self->fd_, sizeof(Ring)) != 0 ||
        (self->ring_ = map_ring(self->fd_)) == nullptr) {
      return Error{ErrorCode::kFailed, "no shared memory"};
    }
    return std::unique_ptr<ImageSource>(std::move(self));
  }
  std::string address() const override {
    return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(fd_);
  }
  Status connect() override {
    for (int i = 0; i < 4000 && ring_->is_read == 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return ring_->is_read != 0 ? Status()
                               : Status(Error{ErrorCode::kTimeout, "the receiving process did not appear"});
  }
  void send(const std::function<void(std::uint8_t*)>& fill) override {
    fill(ring_->slots[ring_->written % kSlots].data());
    ring_->written.fetch_add(1);
    futex(ring_->written, FUTEX_WAKE, 1);
  }

 private:
  int fd_ = -1;
  Ring* ring_ = nullptr;
};

Status receive_ring(int /*domain*/, const std::string& address, const ImageSink& sink,
                    const std::function<void()>& wait) {
  const int fd = open(address.c_str(), O_RDWR | O_CLOEXEC);
  Ring* ring = fd < 0 ? nullptr : map_ring(fd);
  if (ring == nullptr) return Error{ErrorCode::kNotFound, "the ring is not there"};
  std::atomic<bool> is_over{false};
  std::thread worker([&] {
    std::uint32_t read = ring->written;
    ring->is_read = 1;
    while (!is_over) {
      const std::uint32_t written = ring->written;
      if (written == read) {
        futex(ring->written, FUTEX_WAIT, written);
        continue;
      }
      read = written - read > kSlots ? written - 1 : read;  // what was written over is lost
      sink(ring->slots[read % kSlots]);
      ++read;
    }
  });
  wait();
  is_over = true;
  futex(ring->written, FUTEX_WAKE, 1);
  ring->written.fetch_add(1);
  futex(ring->written, FUTEX_WAKE, 1);
  worker.join();
  munmap(ring, sizeof(Ring));
  close(fd);
  return {};
}

class SocketSource final : public ImageSource {
 public:
  ~SocketSource() override {
    close(connection_);
    close(listener_);
  }
  static Result<std::unique_ptr<ImageSource>> make(int /*domain*/) {
    auto self = std::make_unique<SocketSource>();
    self->listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const UnixAddress address(self->address());
    if (bind(self->listener_, address.get(), address.length) != 0 || listen(self->listener_, 1) != 0) {
      return Error{ErrorCode::kFailed, std::string("a Unix socket cannot be made: ") + std::strerror(errno)};
    }
    return std::unique_ptr<ImageSource>(std::move(self));
  }
  std::string address() const override { return "nido-bench-image/" + std::to_string(getpid()); }
  Status connect() override {
    connection_ = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    return {};
  }
  void send(const std::function<void(std::uint8_t*)>& fill) override {
    fill(image_.data());
    for (std::size_t sent = 0; sent < image_.size();) {
      const ssize_t some = ::send(connection_, image_.data() + sent, image_.size() - sent, MSG_NOSIGNAL);
      if (some <= 0) return;
      sent += static_cast<std::size_t>(some);
    }
  }

 private:
  int listener_ = -1;
  int connection_ = -1;
  std::vector<std::uint8_t> image_ = std::vector<std::uint8_t>(kImage_bytes);
};

Status receive_socket(int /*domain*/, const std::string& name, const ImageSink& sink,
                      const std::function<void()>& wait) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const UnixAddress address(name);
  if (::connect(fd, address.get(), address.length) != 0) {
    return Error{ErrorCode::kNotFound, "the sending process is not there"};
  }
  std::thread worker([&] {
    std::vector<std::uint8_t> image(kImage_bytes);
    while (recv(fd, image.data(), image.size(), MSG_WAITALL) == static_cast<ssize_t>(image.size())) {
      sink(image);
    }
  });
  wait();
  shutdown(fd, SHUT_RDWR);
  worker.join();
  close(fd);
  return {};
}

}  // namespace

ImageWay bare_ring_image() { return {"bare ring in shared memory", "", RingSource::make, receive_ring}; }
ImageWay unix_socket_image() { return {"bare Unix socket", "", SocketSource::make, receive_socket}; }

}  // namespace nido::bench
