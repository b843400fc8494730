#include "common/link/udp.hpp"

// Asio's fences order handlers of other threads; here are none, and the thread sanitizer cannot follow fences.
#define ASIO_DISABLE_FENCED_BLOCK

#include <linux/filter.h>
#include <linux/sock_diag.h>
#include <sys/socket.h>

#include <algorithm>
#include <asio/buffer.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <charconv>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace farhand {
namespace {

using asio::ip::udp;

asio::ip::address to_address(const UdpEndpoint& endpoint) noexcept {
  if (endpoint.v6) return asio::ip::address_v6(endpoint.address);
  asio::ip::address_v4::bytes_type bytes{};
  std::copy_n(endpoint.address.begin(), bytes.size(), bytes.begin());
  return asio::ip::address_v4(bytes);
}

udp::endpoint to_asio(const UdpEndpoint& endpoint) noexcept { return {to_address(endpoint), endpoint.port}; }

UdpEndpoint from_asio(const udp::endpoint& endpoint) noexcept {
  UdpEndpoint result;
  result.port = endpoint.port();
  result.v6 = endpoint.protocol() == udp::v6();
  if (result.v6) {
    result.address = endpoint.address().to_v6().to_bytes();
  } else {
    const auto bytes = endpoint.address().to_v4().to_bytes();
    std::copy(bytes.begin(), bytes.end(), result.address.begin());
  }
  return result;
}

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw std::invalid_argument("address '" + std::string(text) + "': " + why);
}

std::uint16_t parse_port(std::string_view text, std::string_view port, EndpointUse use) {
  const unsigned lowest = use == EndpointUse::kListen ? 0 : 1;
  unsigned value = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), value);
  if (error != std::errc{} || end != port.data() + port.size() || value < lowest || value > 65535) {
    refuse(text,
           "the port '" + std::string(port) + "' is not a whole number from " + std::to_string(lowest) + " to 65535");
  }
  return static_cast<std::uint16_t>(value);
}

void require_reach(const UdpEndpoint& endpoint, Reach reach) {
  if (reach == Reach::kAnywhere || endpoint.is_loopback()) return;
  throw std::invalid_argument("address '" + to_string(endpoint) +
                              "' is not a loopback address, and here the link is not secured: anyone on that network "
                              "could move the patient's hand; use 127.0.0.1, [::1] or localhost");
}

}  // namespace

UdpHost host_of(const UdpEndpoint& endpoint) noexcept {
  UdpHost host;
  host.v6 = endpoint.v6;
  std::copy_n(endpoint.address.begin(), endpoint.v6 ? host.network.size() : 4, host.network.begin());
  return host;
}

bool UdpEndpoint::is_loopback() const noexcept { return to_address(*this).is_loopback(); }

UdpEndpoint parse_endpoint(std::string_view text, EndpointUse use) {
  constexpr const char* kForm = "write ADDR:PORT, for example 127.0.0.1:7000 or [::1]:7000";
  const bool bracketed = text.starts_with('[');
  const std::size_t host_end = bracketed ? text.find(']') : text.rfind(':');
  if (bracketed && host_end == std::string_view::npos) refuse(text, std::string("the bracket is not closed; ") + kForm);
  const std::size_t colon = bracketed ? host_end + 1 : host_end;
  if (colon >= text.size() || text[colon] != ':') refuse(text, std::string("the port is missing; ") + kForm);

  std::string host(bracketed ? text.substr(1, host_end - 1) : text.substr(0, host_end));
  if (host.empty()) refuse(text, std::string("the address is missing; ") + kForm);
  if (!bracketed && host.find(':') != std::string::npos) {
    refuse(text, std::string("an IPv6 address needs brackets; ") + kForm);
  }
  if (!bracketed && host == "localhost") host = "127.0.0.1";
  asio::error_code error;
  const asio::ip::address address = asio::ip::make_address(host, error);
  // A zone (%eth0) belongs to link-local addresses, which are never loopback.
  if (error || address.is_v6() != bracketed || host.find('%') != std::string::npos) {
    refuse(text, "'" + host + "' is not a numeric address; names other than localhost are not looked up");
  }
  return from_asio({address, parse_port(text, text.substr(colon + 1), use)});
}

std::string to_string(const UdpEndpoint& endpoint) {
  const std::string host = to_address(endpoint).to_string();
  return (endpoint.v6 ? "[" + host + "]" : host) + ":" + std::to_string(endpoint.port);
}

struct UdpSocket::Impl {
  asio::io_context context;
  udp::socket socket{context};
  std::optional<UdpEndpoint> peer;
  bool connected = false;
  Counters counters;
  std::uint32_t kernel_said = 0;  // it counts in 32 bits
  std::uint64_t kernel_dropped = 0;

  // The more the socket holds, the longer may a tick be late while strangers send. The system may give less.
  void make_room() noexcept {
    asio::error_code ignored;
    socket.set_option(udp::socket::receive_buffer_size(1 << 20), ignored);
  }

  void count(const asio::error_code& error) noexcept {
    if (error == asio::error::would_block || error == asio::error::try_again) {
      ++counters.would_block;
    } else if (error == asio::error::connection_refused) {
      ++counters.refused;
    } else {
      ++counters.errors;
    }
  }
};

UdpSocket::UdpSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
UdpSocket::UdpSocket(UdpSocket&&) noexcept = default;
UdpSocket& UdpSocket::operator=(UdpSocket&&) noexcept = default;
UdpSocket::~UdpSocket() = default;

UdpSocket UdpSocket::listen(const UdpEndpoint& local, Reach reach) {
  require_reach(local, reach);
  auto impl = std::make_unique<Impl>();
  const udp::endpoint endpoint = to_asio(local);
  asio::error_code error;
  // No SO_REUSEADDR: two stations on one port would each get some of the packets.
  impl->socket.open(endpoint.protocol(), error);
  if (!error) impl->socket.bind(endpoint, error);
  if (!error) impl->socket.non_blocking(true, error);
  if (error) {
    const char* remedy = error == asio::error::address_in_use ? "; another program uses that port, choose another or 0"
                         : error == asio::error::access_denied
                             ? "; ports below 1024 need a privilege, choose a higher one"
                             : "";
    throw std::runtime_error("cannot listen on " + to_string(local) + ": " + error.message() + remedy);
  }
  impl->make_room();
  return UdpSocket(std::move(impl));
}

UdpSocket UdpSocket::dial(const UdpEndpoint& peer, Reach reach) {
  require_reach(peer, reach);
  auto impl = std::make_unique<Impl>();
  const udp::endpoint endpoint = to_asio(peer);
  asio::error_code error;
  impl->socket.open(endpoint.protocol(), error);
  if (!error) impl->socket.connect(endpoint, error);
  if (!error) impl->socket.non_blocking(true, error);
  if (error) throw std::runtime_error("cannot dial " + to_string(peer) + ": " + error.message());
  impl->make_room();
  impl->peer = peer;
  impl->connected = true;
  return UdpSocket(std::move(impl));
}

UdpEndpoint UdpSocket::local_endpoint() const { return from_asio(impl_->socket.local_endpoint()); }
std::optional<UdpEndpoint> UdpSocket::peer() const noexcept { return impl_->peer; }

bool UdpSocket::send(std::span<const std::byte> bytes) noexcept { return impl_->peer && send_to(bytes, *impl_->peer); }

bool UdpSocket::send_to(std::span<const std::byte> bytes, const UdpEndpoint& to) noexcept {
  if (impl_->connected && to != *impl_->peer) return false;
  asio::error_code error;
  const asio::const_buffer buffer(bytes.data(), bytes.size());
  if (impl_->connected) {
    impl_->socket.send(buffer, 0, error);
  } else {
    impl_->socket.send_to(buffer, to_asio(to), 0, error);
  }
  if (error) {
    impl_->count(error);
    return false;
  }
  ++impl_->counters.sent;
  return true;
}

std::optional<UdpSocket::Received> UdpSocket::receive(std::span<std::byte> buffer) noexcept {
  asio::error_code error;
  udp::endpoint sender;
  // MSG_TRUNC: the kernel returns the true length, so a datagram that was cut to our buffer is not taken for a whole
  // one.
  const std::size_t size =
      impl_->socket.receive_from(asio::mutable_buffer(buffer.data(), buffer.size()), sender, MSG_TRUNC, error);
  if (error == asio::error::would_block || error == asio::error::try_again) return std::nullopt;
  if (error) {
    impl_->count(error);
    return Received{.dropped = true};
  }
  if (size > buffer.size()) {
    ++impl_->counters.oversized;
    return Received{.dropped = true};
  }
  ++impl_->counters.received;
  return Received{size, from_asio(sender)};
}

bool UdpSocket::refuse_longer_than(std::size_t bytes) noexcept {
  constexpr std::uint32_t kHeaderBytes = 8;  // of UDP: the filter sees it too
  sock_filter code[] = {
      {BPF_LD | BPF_W | BPF_LEN, 0, 0, 0},
      {BPF_JMP | BPF_JGT | BPF_K, 0, 1, static_cast<std::uint32_t>(bytes) + kHeaderBytes},
      {BPF_RET | BPF_K, 0, 0, 0},           // longer: drop
      {BPF_RET | BPF_K, 0, 0, 0x7FFFFFFF},  // else take it whole
  };
  const sock_fprog program{std::size(code), code};
  return ::setsockopt(native_handle(), SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

std::uint64_t UdpSocket::dropped_by_kernel() const noexcept {
  std::array<std::uint32_t, SK_MEMINFO_VARS> said{};
  socklen_t size = sizeof said;
  if (::getsockopt(native_handle(), SOL_SOCKET, SO_MEMINFO, said.data(), &size) == 0 &&
      size > SK_MEMINFO_DROPS * sizeof said[0]) {
    impl_->kernel_dropped += said[SK_MEMINFO_DROPS] - std::exchange(impl_->kernel_said, said[SK_MEMINFO_DROPS]);
  }
  return impl_->kernel_dropped;
}

void UdpSocket::accept(const UdpEndpoint& sender) noexcept {
  if (!impl_->connected) impl_->peer = sender;
}

const UdpSocket::Counters& UdpSocket::counters() const noexcept { return impl_->counters; }
int UdpSocket::native_handle() const noexcept { return impl_->socket.native_handle(); }

}  // namespace farhand
