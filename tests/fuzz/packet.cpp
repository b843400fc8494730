// Datagrams of the peer as they come out of the seal or, with --insecure, off the socket. The input is read twice: as
// one datagram, and as a run of packets whose checksums are mended, because no mutation finds a CRC by itself.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "common/link/codec.hpp"
#include "common/link/receiver.hpp"
#include "tests/fuzz/targets.hpp"

namespace farhand::fuzz {
namespace {

// Bit by bit, without the codec's table.
std::uint32_t plain_crc32c(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0x82F63B78u & (0u - (crc & 1)));
  }
  return ~crc;
}

std::uint32_t stated_checksum(std::span<const std::byte> datagram) {
  std::uint32_t stated = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    stated |= std::to_integer<std::uint32_t>(datagram[datagram.size() - 4 + i]) << 8 * i;
  }
  return stated;
}
bool intact(std::span<const std::byte> datagram) {
  return datagram.size() >= 6 && plain_crc32c(datagram.first(datagram.size() - 6)) == stated_checksum(datagram);
}
void mend(std::span<std::byte> datagram) {
  if (datagram.size() < 6) return;
  const std::uint32_t crc = plain_crc32c(datagram.first(datagram.size() - 6));
  for (std::size_t i = 0; i < 4; ++i) datagram[datagram.size() - 4 + i] = static_cast<std::byte>(crc >> 8 * i);
}

template <int N>
bool decode(PacketCodec<N>& codec, std::size_t size, std::span<const std::byte> datagram, Packet<N>& packet) {
  packet.seq = 0xABCDEF01;
  const DecodeResult result = codec.decode(datagram, packet);
  require(static_cast<std::size_t>(result) < kDecodeResults, "the result is one that is counted");
  if (result != DecodeResult::kOk) {
    require(packet.seq == 0xABCDEF01, "what is rejected is not given out");
    require(result != DecodeResult::kVersion || intact(datagram), "only an intact packet speaks of its version");
    return false;
  }
  require(datagram.size() == size, "an accepted packet has the one size");
  require(intact(datagram), "an accepted packet has its checksum");
  require(packet.motion.finite() && packet.previous.finite(), "accepted motion is finite");
  require(packet.state <= kLastState && (packet.limits & ~kPacketBits) == 0, "accepted states and limits are known");
  const auto again = codec.encode(packet);
  require(std::equal(again.begin(), again.end(), datagram.begin(), datagram.end()),
          "what decodes encodes to its bytes");
  return true;
}

// Whatever the peer says, what is shown is finite and runs forward, and what is taken is no older than allowed.
void receive(Receiver<1>& receiver, const Packet<1>& packet, Nanoseconds now) {
  const std::uint64_t before = receiver.counters().received;
  const std::uint64_t sessions = receiver.counters().sessions;
  const Played<1> shown = receiver.play(now);
  const Receipt receipt = receiver.accept(packet, now);
  const bool taken = receipt == Receipt::kAccepted || receipt == Receipt::kReordered;
  require(receiver.counters().received == before + (taken ? 1 : 0), "what is taken is counted, and nothing else");
  const Played<1> next = receiver.play(now);
  require(next.motion.finite(), "what is shown is finite");
  require(next.depth >= 0, "nothing is shown before it came");
  // Where it does not, the station is told to let go of what it believed.
  const bool told = receiver.take_lapse();
  const bool same = receiver.counters().sessions == sessions && shown.any && !told;
  require(!same || next.content_time >= shown.content_time, "time runs forward within a session");
}

}  // namespace

constexpr std::size_t kFilled = PacketCodec<1>::kSize + PacketCodec<1>::kPreviousBytes;

bool packet(Bytes input) {
  static PacketCodec<1> one, filled({.previous = true});
  static PacketCodec<2> two;
  const auto decodes = [](std::span<const std::byte> datagram, Packet<1>& packet_of_one, Packet<2>& packet_of_two) {
    return decode(one, PacketCodec<1>::kSize, datagram, packet_of_one) ||
           decode(two, PacketCodec<2>::kSize, datagram, packet_of_two) ||
           decode(filled, kFilled, datagram, packet_of_one);
  };
  Packet<1> packet_of_one;
  Packet<2> packet_of_two;
  std::vector<std::byte> whole(input.size());
  std::transform(input.begin(), input.end(), whole.begin(), [](std::uint8_t b) { return static_cast<std::byte>(b); });
  bool taken = decodes(whole, packet_of_one, packet_of_two);
  mend(whole);
  taken = decodes(whole, packet_of_one, packet_of_two) || taken;

  // A byte of the milliseconds between two, its highest bit for the layout, then a packet.
  std::optional<Receiver<1>> receiver;
  Cursor cursor(input);
  Nanoseconds now = kSecond;
  while (!cursor.empty()) {
    const unsigned choice = cursor.byte();
    now += (choice & 0x7F) * kMillisecond;
    const bool has_previous = (choice & 0x80) != 0;
    const std::size_t size = has_previous ? kFilled : PacketCodec<1>::kSize;
    const Bytes raw = cursor.take(size);
    std::array<std::byte, kFilled> bytes{};
    if (!raw.empty()) std::memcpy(bytes.data(), raw.data(), raw.size());
    const std::span<std::byte> datagram = std::span(bytes).first(size);
    mend(datagram);
    if (!decode(has_previous ? filled : one, size, datagram, packet_of_one)) continue;
    taken = true;
    if (!receiver) {
      receiver.emplace(
          ReceiverParams{.timeout = 100 * kMillisecond, .playout_max = 500 * kMillisecond, .expiry = kSecond}, 1);
    }
    receive(*receiver, packet_of_one, now);
  }
  return taken;
}

}  // namespace farhand::fuzz
