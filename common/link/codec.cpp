#include "common/link/codec.hpp"

#include <isa-l/crc.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "proto/packet.pb.h"

namespace farhand {
namespace {

constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kChecksumFieldBytes = 2 + kChecksumBytes;
constexpr std::size_t kVersionFieldBytes = 1 + 4;

static_assert(std::endian::native == std::endian::little, "values are copied as Protobuf writes them");

// Where the values of a packet stand, in the order of proto/packet.proto: a tag of one byte before each, a length too
// before the vectors. The constructor holds it against what Protobuf writes.
enum Field : std::size_t {
  kVersion = 1,
  kSession = kVersion + 4 + 1,
  kSeq = kSession + 4 + 1,
  kSendTime = kSeq + 4 + 1,
  kEchoSession = kSendTime + 8 + 1,
  kEchoSeq = kEchoSession + 4 + 1,
  kEchoSendTime = kEchoSeq + 4 + 1,
  kEchoDwell = kEchoSendTime + 8 + 1,
  kExpiry = kEchoDwell + 4 + 1,
  kState = kExpiry + 4 + 1,
  kLimitBits = kState + 4 + 1,
  kMotion = kLimitBits + 4 + 2,
};

template <class T>
T load(const std::byte* from) noexcept {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

template <class T>
void store(T value, std::byte* to) noexcept {
  std::memcpy(to, &value, sizeof value);
}

bool checksum_matches(std::span<const std::byte> bytes) noexcept {
  return crc32c(bytes.first(bytes.size() - kChecksumFieldBytes)) ==
         load<std::uint32_t>(&bytes[bytes.size() - kChecksumBytes]);
}

// A packet of another version differs in size or layout. If version and checksum stand where every version keeps them,
// say so: it tells the user to update one side instead of looking for a bad cable.
DecodeResult foreign(std::span<const std::byte> bytes, std::byte version_tag, DecodeResult otherwise) noexcept {
  const bool intact =
      bytes.size() >= kVersionFieldBytes + kChecksumFieldBytes && bytes[0] == version_tag && checksum_matches(bytes);
  return intact && load<std::uint32_t>(&bytes[kVersion]) != kProtocolVersion ? DecodeResult::kVersion : otherwise;
}

// What Protobuf writes, before the checksum.
template <int N>
wire::Packet message_of(const Packet<N>& packet, PacketParts parts) {
  wire::Packet message;
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
  for (int i = 0; i < N; ++i) {
    message.add_x(packet.motion.x[i]);
    message.add_v(packet.motion.v[i]);
    message.add_f(packet.motion.f[i]);
  }
  if (parts.energy) message.set_energy(packet.energy);
  if (parts.previous) {
    for (int i = 0; i < N; ++i) {
      message.add_previous_x(packet.previous.x[i]);
      message.add_previous_v(packet.previous.v[i]);
      message.add_previous_f(packet.previous.f[i]);
    }
    message.set_previous_age_ns(packet.previous_age_ns);
  }
  message.set_friction_nm(packet.friction);
  message.set_friction_known(packet.friction_known);
  message.set_crc32c(0);
  return message;
}

// A packet in which every byte of every value is one of its own.
template <int N>
Packet<N> told_apart() {
  Packet<N> packet;
  packet.session = 0x04030201;
  packet.seq = 0x08070605;
  packet.send_time_ns = 0x100F0E0D0C0B0A09;
  packet.echo_session = 0x14131211;
  packet.echo_seq = 0x18171615;
  packet.echo_send_time_ns = 0x201F1E1D1C1B1A19;
  packet.echo_dwell_ns = 0x24232221;
  packet.expiry_ms = 0x28272625;
  packet.state = kLastState;
  packet.limits = kAllLimits;
  double value = 1.1;
  for (Joints<N>* vector : {&packet.motion.x, &packet.motion.v, &packet.motion.f}) {
    for (int i = 0; i < N; ++i) (*vector)[i] = value *= 1.7;
  }
  packet.energy = value *= 1.7;
  packet.previous_age_ns = 0x2C2B2A29;
  for (Joints<N>* vector : {&packet.previous.x, &packet.previous.v, &packet.previous.f}) {
    for (int i = 0; i < N; ++i) (*vector)[i] = value *= 1.7;
  }
  packet.friction = value * 1.7;
  packet.friction_known = true;
  return packet;
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept {
  // The library takes its argument as not const, and writes nothing.
  auto* from = const_cast<unsigned char*>(reinterpret_cast<const unsigned char*>(bytes.data()));
  return ~crc32_iscsi(from, static_cast<int>(bytes.size()), 0xFFFFFFFFu);
}

template <int N>
PacketCodec<N>::PacketCodec(PacketParts parts)
    : parts_(parts), size_(kSize + (parts.energy ? kEnergyBytes : 0) + (parts.previous ? kPreviousBytes : 0)) {
  std::size_t at = 0;
  const auto field = [&](std::size_t structure_bytes, std::size_t value_bytes) {
    std::fill_n(&structure_[at], structure_bytes, std::byte{0xFF});
    at += structure_bytes + value_bytes;
  };
  for (const std::size_t value_bytes : {4, 4, 4, 8, 4, 4, 8, 4, 4, 4, 4}) field(1, value_bytes);
  for (int vector = 0; vector < 3; ++vector) field(2, 8 * std::size_t{N});
  if (parts.energy) field(1, 8);
  if (parts.previous) {
    for (int vector = 0; vector < 3; ++vector) field(3, 8 * std::size_t{N});
    field(2, 4);
  }
  field(2, 8);
  field(2, 4);
  field(2, kChecksumBytes);

  // The same bytes as Protobuf's, or its layout is another one.
  const Packet<N> packet = told_apart<N>();
  const wire::Packet message = message_of(packet, parts);
  Bytes expected{};
  if (at != size_ || message.ByteSizeLong() != size_ ||
      !message.SerializeToArray(expected.data(), static_cast<int>(size_)))
    throw std::logic_error("proto/packet.proto and PacketCodec::kSize differ");
  std::transform(expected.begin(), expected.end(), structure_.begin(), skeleton_.begin(),
                 [](std::byte value, std::byte mask) { return value & mask; });
  buffer_ = skeleton_;
  const std::span<const std::byte> ours = encode(packet);
  const std::size_t checked = size_ - kChecksumBytes;
  Packet<N> decoded;
  if (!std::equal(ours.begin(), ours.begin() + static_cast<std::ptrdiff_t>(checked), expected.begin()) ||
      decode(ours, decoded) != DecodeResult::kOk || decoded.seq != packet.seq ||
      (decoded.motion.f != packet.motion.f).any() ||
      (parts.previous && (decoded.previous.f != packet.previous.f).any()))
    throw std::logic_error("proto/packet.proto and PacketCodec differ in layout");
}

template <int N>
std::span<const std::byte> PacketCodec<N>::encode(const Packet<N>& packet) noexcept {
  std::byte* const to = buffer_.data();
  store(kProtocolVersion, to + kVersion);
  store(packet.session, to + kSession);
  store(packet.seq, to + kSeq);
  store(packet.send_time_ns, to + kSendTime);
  store(packet.echo_session, to + kEchoSession);
  store(packet.echo_seq, to + kEchoSeq);
  store(packet.echo_send_time_ns, to + kEchoSendTime);
  store(packet.echo_dwell_ns, to + kEchoDwell);
  store(packet.expiry_ms, to + kExpiry);
  store(static_cast<std::uint32_t>(packet.state), to + kState);
  store(packet.limits, to + kLimitBits);
  std::size_t at = kMotion;
  for (const Joints<N>* vector : {&packet.motion.x, &packet.motion.v, &packet.motion.f}) {
    std::memcpy(to + at, vector->data(), 8 * std::size_t{N});
    at += 8 * std::size_t{N} + 2;
  }
  std::size_t end = at - 2;
  if (parts_.energy) {
    store(packet.energy, to + end + 1);
    end += kEnergyBytes;
  }
  if (parts_.previous) {
    for (const Joints<N>* vector : {&packet.previous.x, &packet.previous.v, &packet.previous.f}) {
      std::memcpy(to + end + 3, vector->data(), 8 * std::size_t{N});
      end += 3 + 8 * std::size_t{N};
    }
    store(packet.previous_age_ns, to + end + 2);
    end += 2 + 4;
  }
  store(packet.friction, to + end + 2);
  store(std::uint32_t{packet.friction_known}, to + end + 12);
  const std::span<const std::byte> bytes(buffer_.data(), size_);
  store(crc32c(bytes.first(size_ - kChecksumFieldBytes)), to + size_ - kChecksumBytes);
  return bytes;
}

template <int N>
DecodeResult PacketCodec<N>::decode(std::span<const std::byte> bytes, Packet<N>& out) noexcept {
  if (bytes.size() != size_) return foreign(bytes, skeleton_[0], DecodeResult::kSize);
  Bytes copy{};
  std::memcpy(copy.data(), bytes.data(), size_);
  std::uint64_t differs = 0;
  for (std::size_t i = 0; i < copy.size(); i += 8) {
    const std::byte* const at = copy.data() + i;
    differs |= (load<std::uint64_t>(at) & load<std::uint64_t>(&structure_[i])) ^ load<std::uint64_t>(&skeleton_[i]);
  }
  if (differs != 0) return foreign(bytes, skeleton_[0], DecodeResult::kFormat);
  if (!checksum_matches(bytes)) return DecodeResult::kChecksum;
  const std::byte* const from = copy.data();
  if (load<std::uint32_t>(from + kVersion) != kProtocolVersion) return DecodeResult::kVersion;
  const auto state = load<std::uint32_t>(from + kState), limits = load<std::uint32_t>(from + kLimitBits);
  if (state > static_cast<std::uint32_t>(kLastState) || (limits & ~kPacketBits) != 0) return DecodeResult::kValue;
  Packet<N> packet;
  packet.session = load<std::uint32_t>(from + kSession);
  packet.seq = load<std::uint32_t>(from + kSeq);
  packet.send_time_ns = load<std::int64_t>(from + kSendTime);
  packet.echo_session = load<std::uint32_t>(from + kEchoSession);
  packet.echo_seq = load<std::uint32_t>(from + kEchoSeq);
  packet.echo_send_time_ns = load<std::int64_t>(from + kEchoSendTime);
  packet.echo_dwell_ns = load<std::uint32_t>(from + kEchoDwell);
  packet.expiry_ms = load<std::uint32_t>(from + kExpiry);
  packet.state = static_cast<StationState>(state);
  packet.limits = limits;
  std::size_t at = kMotion;
  for (Joints<N>* vector : {&packet.motion.x, &packet.motion.v, &packet.motion.f}) {
    std::memcpy(vector->data(), from + at, 8 * std::size_t{N});
    at += 8 * std::size_t{N} + 2;
  }
  std::size_t end = at - 2;
  if (parts_.energy) {
    packet.energy = load<double>(from + end + 1);
    end += kEnergyBytes;
  }
  if (parts_.previous) {
    for (Joints<N>* vector : {&packet.previous.x, &packet.previous.v, &packet.previous.f}) {
      std::memcpy(vector->data(), from + end + 3, 8 * std::size_t{N});
      end += 3 + 8 * std::size_t{N};
    }
    packet.previous_age_ns = load<std::uint32_t>(from + end + 2);
    end += 2 + 4;
  }
  packet.friction = load<double>(from + end + 2);
  const auto friction_known = load<std::uint32_t>(from + end + 12);
  if (friction_known > 1) return DecodeResult::kValue;
  packet.friction_known = friction_known == 1;
  if (!packet.motion.finite() || !std::isfinite(packet.energy) || !packet.previous.finite() ||
      !std::isfinite(packet.friction))
    return DecodeResult::kNotFinite;
  out = packet;
  return DecodeResult::kOk;
}

template class PacketCodec<1>;
template class PacketCodec<2>;

}  // namespace farhand
