// Input and output of OpenSSL: datagrams in memory, kept separate. OpenSSL's own memory BIO is a stream and would join
// them; its datagram BIO owns a socket and a clock.
#pragma once

#include <openssl/bio.h>

#include <cstddef>
#include <deque>
#include <span>
#include <utility>
#include <vector>

namespace farhand {

class DatagramBio {
 public:
  // The largest datagram that OpenSSL may write: every handshake message then fits into one.
  static constexpr std::size_t kLargest = 480;

  DatagramBio();
  ~DatagramBio();
  DatagramBio(const DatagramBio&) = delete;
  DatagramBio& operator=(const DatagramBio&) = delete;

  BIO* get() const noexcept { return bio_; }
  void deliver(std::span<const std::byte> datagram) { to_read_.emplace_back(datagram.begin(), datagram.end()); }
  std::vector<std::vector<std::byte>> take_written() { return std::exchange(written_, {}); }

  // Called by OpenSSL.
  int read(char* to, std::size_t room);
  void write(const char* from, std::size_t size);

 private:
  BIO* bio_;
  std::deque<std::vector<std::byte>> to_read_;
  std::vector<std::vector<std::byte>> written_;
};

}  // namespace farhand
