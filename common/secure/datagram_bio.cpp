#include "common/secure/datagram_bio.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace farhand {
namespace {

DatagramBio& owner(BIO* bio) { return *static_cast<DatagramBio*>(BIO_get_data(bio)); }

int read_one(BIO* bio, char* to, int room) {
  BIO_clear_retry_flags(bio);
  const int size = owner(bio).read(to, static_cast<std::size_t>(std::max(room, 0)));
  if (size < 0) BIO_set_retry_read(bio);
  return size;
}

int write_one(BIO* bio, const char* from, int size) {
  BIO_clear_retry_flags(bio);
  owner(bio).write(from, static_cast<std::size_t>(std::max(size, 0)));
  return size;
}

// Everything that DTLS asks of a socket (peer, MTU of the path, time-outs) is decided elsewhere.
long control(BIO*, int command, long, void*) { return command == BIO_CTRL_FLUSH ? 1 : 0; }

const BIO_METHOD* method() {
  static const BIO_METHOD* const made = [] {
    BIO_METHOD* m = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "datagrams in memory");
    if (m == nullptr) throw std::runtime_error("OpenSSL has no memory for a BIO");
    BIO_meth_set_read(m, read_one);
    BIO_meth_set_write(m, write_one);
    BIO_meth_set_ctrl(m, control);
    return m;
  }();
  return made;
}

}  // namespace

DatagramBio::DatagramBio() : bio_(BIO_new(method())) {
  if (bio_ == nullptr) throw std::runtime_error("OpenSSL has no memory for a BIO");
  BIO_set_data(bio_, this);
  BIO_set_init(bio_, 1);
}

DatagramBio::~DatagramBio() { BIO_free(bio_); }

// Whatever does not fit is cut, as a socket does.
int DatagramBio::read(char* to, std::size_t room) {
  if (to_read_.empty()) return -1;
  const std::vector<std::byte> datagram = std::move(to_read_.front());
  to_read_.pop_front();
  const std::size_t size = std::min(room, datagram.size());
  std::copy_n(reinterpret_cast<const char*>(datagram.data()), size, to);
  return static_cast<int>(size);
}

void DatagramBio::write(const char* from, std::size_t size) {
  const std::byte* bytes = reinterpret_cast<const std::byte*>(from);
  written_.emplace_back(bytes, bytes + size);
}

}  // namespace farhand
