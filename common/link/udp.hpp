// Datagrams to and from one peer, called from the loop: no function waits, and none allocates after the first packet.
// Asio stays in the .cpp, because it and Boost.Asio cannot be used in one translation unit. Only loopback addresses are
// accepted, unless the link is secured.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace farhand {

// A numeric address and a port. IPv4 uses the first four bytes.
struct UdpEndpoint {
  std::array<std::uint8_t, 16> address{};
  std::uint16_t port = 0;
  bool v6 = false;

  bool is_loopback() const noexcept;
  bool operator==(const UdpEndpoint&) const = default;
};

// Identity of a host, whatever ports it uses: an IPv4 address, or the upper 64 bits of an IPv6 address, because a
// network assigns these to a host and leaves it the rest.
struct UdpHost {
  std::array<std::uint8_t, 8> network{};
  bool v6 = false;
  bool operator==(const UdpHost&) const = default;
};
UdpHost host_of(const UdpEndpoint& endpoint) noexcept;

// "127.0.0.1:7000", "[::1]:7000", "localhost:7000"; other names are refused, so that no start hangs in a name server.
// Port 0 lets the system choose and makes sense only for listening. Throws std::invalid_argument with a sentence.
enum class EndpointUse { kListen, kPeer };
UdpEndpoint parse_endpoint(std::string_view text, EndpointUse use);
std::string to_string(const UdpEndpoint& endpoint);

// Addresses that a socket may use. kAnywhere is for datagrams that are sealed and authenticated end to end.
enum class Reach { kLoopback, kAnywhere };

class UdpSocket {
 public:
  struct Received {
    std::size_t size = 0;
    UdpEndpoint sender{};
    bool dropped = false;  // too long, or an error: counted; the other members are not set
  };

  struct Counters {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t would_block = 0;  // not sent because the output buffer was full
    std::uint64_t refused = 0;      // ICMP said that nobody listens there (yet): the peer may still come
    std::uint64_t oversized = 0;    // longer than the buffer: cannot be ours, dropped whole
    std::uint64_t errors = 0;       // anything else
  };

  // Waits for peers; answers go nowhere until `accept`. Throws std::invalid_argument (address not loopback) or
  // std::runtime_error (port busy, not permitted), both with a sentence.
  static UdpSocket listen(const UdpEndpoint& local, Reach reach = Reach::kLoopback);
  // Dials out: the kernel drops datagrams that do not come from this peer.
  static UdpSocket dial(const UdpEndpoint& peer, Reach reach = Reach::kLoopback);

  UdpSocket(UdpSocket&&) noexcept;
  UdpSocket& operator=(UdpSocket&&) noexcept;
  ~UdpSocket();

  UdpEndpoint local_endpoint() const;
  std::optional<UdpEndpoint> peer() const noexcept;

  // To the peer. False when it was not sent: no peer yet, buffer full, or an error (counted).
  bool send(std::span<const std::byte> bytes) noexcept;
  // To another address; a socket that dialled out has only its peer.
  bool send_to(std::span<const std::byte> bytes, const UdpEndpoint& to) noexcept;
  // The next datagram, or an empty value if none waits. A dropped datagram is returned too, so that the caller, which
  // bounds its loop against a flood, goes on to the next one.
  std::optional<Received> receive(std::span<std::byte> buffer) noexcept;
  // Answers go to the newest sender whose packet was valid. Only the caller can judge this; a forged packet must not
  // redirect the answers.
  void accept(const UdpEndpoint& sender) noexcept;

  // Asks the kernel to drop longer datagrams before they take room in the socket: 13 datagrams of 9000 bytes fill it,
  // and later ones are lost. Returns false if this kernel cannot; then they come as `dropped`.
  bool refuse_longer_than(std::size_t bytes) noexcept;

  const Counters& counters() const noexcept;
  // Datagrams that the kernel dropped: longer than allowed, or the socket was full. A system call of 0.2 us.
  std::uint64_t dropped_by_kernel() const noexcept;
  int native_handle() const noexcept;  // for poll()

 private:
  struct Impl;
  explicit UdpSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace farhand
