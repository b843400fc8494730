// One DTLS 1.2 connection (RFC 6347) of OpenSSL, over datagrams in memory and without a clock. It offers only ECDHE-PSK
// with ChaCha20-Poly1305, because a suite that is not offered cannot be negotiated. It agrees on the keys of SRTP (RFC
// 5764) and carries a greeting. Packets do not use this connection, because the replay window of DTLS holds 64 records
// and would drop authentic packets under jitter.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/link/udp.hpp"
#include "common/secure/media_session.hpp"
#include "common/secure/pairing_key.hpp"

namespace farhand {

using Bytes = std::vector<std::byte>;

// Data that all connections of one end share: key, suites, secret of the cookies.
class DtlsContext {
 public:
  // Throws std::runtime_error if this OpenSSL lacks a needed function.
  DtlsContext(LinkEnd end, const PairingKey& key);
  ~DtlsContext();
  DtlsContext(const DtlsContext&) = delete;
  DtlsContext& operator=(const DtlsContext&) = delete;

  struct Impl;
  Impl& impl() const noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

class Dtls {
 public:
  explicit Dtls(const DtlsContext& context);  // the context outlives it
  ~Dtls();
  Dtls(const Dtls&) = delete;
  Dtls& operator=(const Dtls&) = delete;

  // Listener, before a connection belongs to a peer: answers a ClientHello without our cookie with the cookie and keeps
  // no state, so that a forged sender costs no memory. Returns true for a ClientHello with the cookie: go on with
  // step().
  bool listen(std::span<const std::byte> datagram, const UdpEndpoint& from);

  enum class State { kHandshake, kConnected, kFailed };
  // Processes one datagram, if any. Messages of the handshake, answers and alerts come out below.
  State step(std::span<const std::byte> datagram = {});
  State state() const noexcept { return state_; }
  const std::string& why() const noexcept { return why_; }  // after kFailed

  // While connected.
  void send(std::span<const std::byte> message);
  std::optional<Bytes> receive();
  SrtpKeys srtp_keys() const;

  std::vector<Bytes> take_written();

 private:
  struct Impl;
  State fail();
  State check_agreement();

  std::unique_ptr<Impl> impl_;
  State state_ = State::kHandshake;
  std::string why_;
};

}  // namespace farhand
