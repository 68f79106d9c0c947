#include "outgoing.h"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>

namespace nido::yarp {
namespace {

// shorter contents are copied: that costs less than a second piece
constexpr std::size_t kShort = 4096;
// memory that stays for what is sent next
constexpr std::size_t kKept = 64 * 1024;

}  // namespace

void Outgoing::add(const std::string& bytes) {
  if (content_) {
    // they follow the content
    bytes_.erase(0, at_);
    at_ = 0;
    bytes_.append(*content_bytes_, content_at_);
    content_.reset();
  }
  bytes_ += bytes;
}

void Outgoing::add(Carrier carrier, std::shared_ptr<const Content> content, Dialect dialect,
                   const std::string& envelope) {
  if (is_text(carrier)) return add(message(carrier, content->text(), envelope, false));
  const std::string& bytes = content->bytes(dialect);
  if (bytes.size() < kShort) return add(message(carrier, bytes, envelope, false));
  add(message_head(bytes.size(), envelope, false));
  content_ = std::move(content);
  content_bytes_ = &bytes;
  content_at_ = 0;
}

int Outgoing::send_to(int fd) {
  while (!is_empty()) {
    iovec pieces[2] = {{bytes_.data() + at_, bytes_.size() - at_}, {nullptr, content_left()}};
    if (content_) pieces[1].iov_base = const_cast<char*>(content_bytes_->data() + content_at_);
    msghdr header{};
    header.msg_iov = pieces;
    header.msg_iovlen = 2;
    const ssize_t count = sendmsg(fd, &header, MSG_NOSIGNAL);
    if (count < 0) return errno == EINTR ? EAGAIN : errno;
    const std::size_t of_bytes = std::min(static_cast<std::size_t>(count), pieces[0].iov_len);
    at_ += of_bytes;
    content_at_ += static_cast<std::size_t>(count) - of_bytes;
  }
  clear();
  return 0;
}

void Outgoing::clear() {
  bytes_.clear();
  if (bytes_.capacity() > kKept) bytes_.shrink_to_fit();
  at_ = 0;
  content_.reset();
  content_at_ = 0;
}

}  // namespace nido::yarp
