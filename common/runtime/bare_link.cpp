// Packets in the clear, between programs of one machine.
#include <poll.h>

#include <utility>

#include "common/runtime/peer_link.hpp"

namespace farhand {
namespace {

class BareLink final : public PeerLink {
 public:
  explicit BareLink(UdpSocket socket) : socket_(std::move(socket)) {
    socket_.refuse_longer_than(MediaSession::kLargestDatagram);
  }

  void advance(Nanoseconds) noexcept override {}

  Received receive(std::span<std::byte> buffer, Nanoseconds, std::span<const std::byte>& packet) noexcept override {
    const std::optional<UdpSocket::Received> datagram = socket_.receive(buffer);
    if (!datagram) return Received::kNothing;
    if (datagram->dropped) return Received::kOther;
    sender_ = datagram->sender;
    packet = buffer.first(datagram->size);
    return Received::kPacket;
  }

  void accept() noexcept override { socket_.accept(sender_); }
  bool send(std::span<const std::byte> packet) noexcept override { return socket_.send(packet); }

  // Any datagram will do: the loop judges what it says.
  bool called(Nanoseconds) noexcept override {
    pollfd ready{socket_.native_handle(), POLLIN, 0};
    return ::poll(&ready, 1, 0) > 0;
  }

  const UdpSocket& socket() const noexcept override { return socket_; }

 private:
  UdpSocket socket_;
  UdpEndpoint sender_;
};

}  // namespace

std::unique_ptr<PeerLink> make_bare_link(UdpSocket socket) { return std::make_unique<BareLink>(std::move(socket)); }

}  // namespace farhand
