#include "common/link/codec.hpp"

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <stdexcept>

#include "proto/packet.pb.h"

namespace farhand {
namespace {

constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kChecksumFieldBytes = 2 + kChecksumBytes;
constexpr std::size_t kVersionFieldBytes = 1 + 4;

std::uint32_t load_u32(const std::byte* from) noexcept {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(from[i]);
  return value;
}

void store_u32(std::uint32_t value, std::byte* to) noexcept {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<std::byte>(value >> (8 * i));
}

bool checksum_matches(std::span<const std::byte> bytes) noexcept {
  return crc32c(bytes.first(bytes.size() - kChecksumFieldBytes)) == load_u32(&bytes[bytes.size() - kChecksumBytes]);
}

// A packet of another version differs in size or layout. If version and checksum stand where every version keeps them,
// say so: it tells the user to update one side instead of looking for a bad cable.
DecodeResult foreign(std::span<const std::byte> bytes, std::byte version_tag, DecodeResult otherwise) noexcept {
  const bool intact =
      bytes.size() >= kVersionFieldBytes + kChecksumFieldBytes && bytes[0] == version_tag && checksum_matches(bytes);
  return intact && load_u32(&bytes[1]) != kProtocolVersion ? DecodeResult::kVersion : otherwise;
}

template <int N>
void to_message(const Packet<N>& packet, bool with_energy, wire::Packet& message) {
  message.set_version(kProtocolVersion);
  message.set_session(packet.session);
  message.set_seq(packet.seq);
  message.set_send_time_ns(packet.send_time_ns);
  message.set_echo_session(packet.echo_session);
  message.set_echo_seq(packet.echo_seq);
  message.set_echo_send_time_ns(packet.echo_send_time_ns);
  message.set_echo_dwell_ns(packet.echo_dwell_ns);
  message.set_expiry_ms(packet.expiry_ms);
  message.set_state(static_cast<std::uint32_t>(packet.state));
  message.set_limits(packet.limits);
  message.mutable_x()->Resize(N, 0.0);
  message.mutable_v()->Resize(N, 0.0);
  message.mutable_f()->Resize(N, 0.0);
  for (int i = 0; i < N; ++i) {
    message.set_x(i, packet.motion.x[i]);
    message.set_v(i, packet.motion.v[i]);
    message.set_f(i, packet.motion.f[i]);
  }
  if (with_energy) message.set_energy(packet.energy);
  message.set_crc32c(0);
}

template <int N>
Packet<N> from_message(const wire::Packet& message) {
  Packet<N> packet;
  packet.session = message.session();
  packet.seq = message.seq();
  packet.send_time_ns = message.send_time_ns();
  packet.echo_session = message.echo_session();
  packet.echo_seq = message.echo_seq();
  packet.echo_send_time_ns = message.echo_send_time_ns();
  packet.echo_dwell_ns = message.echo_dwell_ns();
  packet.expiry_ms = message.expiry_ms();
  packet.state = static_cast<StationState>(message.state());
  packet.limits = message.limits();
  for (int i = 0; i < N; ++i) {
    packet.motion.x[i] = message.x(i);
    packet.motion.v[i] = message.v(i);
    packet.motion.f[i] = message.f(i);
  }
  packet.energy = message.energy();
  return packet;
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept {
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

template <int N>
PacketCodec<N>::PacketCodec(bool with_energy)
    : with_energy_(with_energy),
      size_(kSize + (with_energy ? kEnergyBytes : 0)),
      message_(std::make_unique<wire::Packet>()) {
  std::size_t at = 0;
  const auto field = [&](std::size_t structure_bytes, std::size_t value_bytes) {
    std::fill_n(&structure_[at], structure_bytes, std::byte{0xFF});
    at += structure_bytes + value_bytes;
  };
  for (const std::size_t value_bytes : {4, 4, 4, 8, 4, 4, 8, 4, 4, 4, 4}) field(1, value_bytes);
  for (int vector = 0; vector < 3; ++vector) field(2, 8 * std::size_t{N});
  if (with_energy) field(1, 8);
  field(2, kChecksumBytes);

  // Encoding once also brings message and checksum table into the state in which they allocate nothing more.
  const auto zeros = encode(Packet<N>{});
  if (at != size_ || message_->ByteSizeLong() != size_)
    throw std::logic_error("proto/packet.proto and PacketCodec::kSize differ");
  std::transform(zeros.begin(), zeros.end(), structure_.begin(), skeleton_.begin(),
                 [](std::byte value, std::byte mask) { return value & mask; });
  Packet<N> decoded;
  if (decode(zeros, decoded) != DecodeResult::kOk)
    throw std::logic_error("proto/packet.proto and PacketCodec differ in layout");
}

template <int N>
PacketCodec<N>::~PacketCodec() = default;

template <int N>
std::span<const std::byte> PacketCodec<N>::encode(const Packet<N>& packet) noexcept {
  const std::span<std::byte> bytes = std::span(buffer_).first(size_);
  to_message(packet, with_energy_, *message_);
  message_->SerializeToArray(bytes.data(), static_cast<int>(size_));
  store_u32(crc32c(bytes.first(size_ - kChecksumFieldBytes)), &bytes[size_ - kChecksumBytes]);
  return bytes;
}

template <int N>
DecodeResult PacketCodec<N>::decode(std::span<const std::byte> bytes, Packet<N>& out) noexcept {
  if (bytes.size() != size_) return foreign(bytes, skeleton_[0], DecodeResult::kSize);
  for (std::size_t i = 0; i < size_; ++i) {
    if ((bytes[i] & structure_[i]) != skeleton_[i]) return foreign(bytes, skeleton_[0], DecodeResult::kFormat);
  }
  if (!checksum_matches(bytes)) return DecodeResult::kChecksum;
  if (!message_->ParseFromArray(bytes.data(), static_cast<int>(size_))) return DecodeResult::kFormat;
  if (message_->version() != kProtocolVersion) return DecodeResult::kVersion;
  if (message_->state() > static_cast<std::uint32_t>(kLastState) || (message_->limits() & ~kAllLimits) != 0) {
    return DecodeResult::kValue;
  }
  const Packet<N> packet = from_message<N>(*message_);
  if (!packet.motion.finite() || !std::isfinite(packet.energy)) return DecodeResult::kNotFinite;
  out = packet;
  return DecodeResult::kOk;
}

template class PacketCodec<1>;
template class PacketCodec<2>;

}  // namespace farhand
