// The codec against an independent encoding and against everything a network can do to a datagram.
#include "common/link/codec.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/support/alloc_counter.hpp"

namespace farhand {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMax = std::numeric_limits<double>::max();

std::uint64_t split_mix(std::uint64_t& x) {
  std::uint64_t z = x += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

template <int N>
Packet<N> random_packet(std::uint64_t& seed) {
  const auto u32 = [&] { return static_cast<std::uint32_t>(split_mix(seed)); };
  const auto finite = [&] {
    for (;;) {
      const double value = std::bit_cast<double>(split_mix(seed));
      if (std::isfinite(value)) return value;
    }
  };
  Packet<N> p;
  p.session = u32();
  p.seq = u32();
  p.send_time_ns = static_cast<Nanoseconds>(split_mix(seed));
  p.echo_session = u32();
  p.echo_seq = u32();
  p.echo_send_time_ns = static_cast<Nanoseconds>(split_mix(seed));
  p.echo_dwell_ns = u32();
  p.expiry_ms = u32();
  p.state = static_cast<StationState>(u32() % 11);
  p.limits = u32() & kPacketBits;
  for (int i = 0; i < N; ++i) {
    p.motion.x[i] = finite();
    p.motion.v[i] = finite();
    p.motion.f[i] = finite();
    p.previous.x[i] = finite();
    p.previous.v[i] = finite();
    p.previous.f[i] = finite();
  }
  p.previous_age_ns = u32();
  p.energy = finite();
  p.friction = finite();
  p.friction_known = u32() % 2 == 1;
  return p;
}

template <int N>
void expect_equal(const Packet<N>& a, const Packet<N>& b) {
  EXPECT_EQ(a.session, b.session);
  EXPECT_EQ(a.seq, b.seq);
  EXPECT_EQ(a.send_time_ns, b.send_time_ns);
  EXPECT_EQ(a.echo_session, b.echo_session);
  EXPECT_EQ(a.echo_seq, b.echo_seq);
  EXPECT_EQ(a.echo_send_time_ns, b.echo_send_time_ns);
  EXPECT_EQ(a.echo_dwell_ns, b.echo_dwell_ns);
  EXPECT_EQ(a.expiry_ms, b.expiry_ms);
  EXPECT_EQ(a.state, b.state);
  EXPECT_EQ(a.limits, b.limits);
  EXPECT_TRUE((a.motion.x == b.motion.x).all());
  EXPECT_TRUE((a.motion.v == b.motion.v).all());
  EXPECT_TRUE((a.motion.f == b.motion.f).all());
  EXPECT_EQ(a.friction, b.friction);
  EXPECT_EQ(a.friction_known, b.friction_known);
}

template <int N>
void expect_equal_previous(const Packet<N>& a, const Packet<N>& b) {
  EXPECT_EQ(a.previous_age_ns, b.previous_age_ns);
  EXPECT_TRUE((a.previous.x == b.previous.x).all());
  EXPECT_TRUE((a.previous.v == b.previous.v).all());
  EXPECT_TRUE((a.previous.f == b.previous.f).all());
}

std::vector<std::byte> copy(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

// With a checksum that is right again after an edit.
void seal(std::vector<std::byte>& bytes) {
  const std::uint32_t crc = crc32c(std::span(bytes).first(bytes.size() - 6));
  for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() - 4 + i] = static_cast<std::byte>(crc >> (8 * i));
}

// Written field by field from the Protobuf encoding rules, with a bitwise CRC-32C, outside this program; `protoc
// --decode` shows the same fields.
constexpr unsigned char kGolden[] = {
    0x0d, 0x02, 0x00, 0x00, 0x00, 0x15, 0xd4, 0xc3, 0xb2, 0xa1, 0x1d, 0x07, 0x00, 0x00, 0x00, 0x21, 0x14,
    0x1a, 0x99, 0xbe, 0x1c, 0x00, 0x00, 0x00, 0x2d, 0x04, 0x03, 0x02, 0x01, 0x35, 0x05, 0x00, 0x00, 0x00,
    0x39, 0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x45, 0x60, 0xe3, 0x16, 0x00, 0x4d, 0xd0, 0x07,
    0x00, 0x00, 0x55, 0x02, 0x00, 0x00, 0x00, 0x5d, 0x21, 0x00, 0x00, 0x00, 0x62, 0x08, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0xe0, 0x3f, 0x6a, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf4, 0xbf, 0x72, 0x08,
    0x9a, 0x99, 0x99, 0x99, 0x99, 0x99, 0xb9, 0x3f, 0xa9, 0x01, 0x9a, 0x99, 0x99, 0x99, 0x99, 0x99, 0xa9,
    0x3f, 0xb5, 0x01, 0x01, 0x00, 0x00, 0x00, 0xfd, 0x7f, 0xdc, 0xdf, 0x96, 0x21};
// The end of the same packet with the previous sample, after f.
constexpr unsigned char kGoldenPrevious[] = {
    0x8a, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xe0, 0x3f, 0x92, 0x01, 0x08, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0xf0, 0xbf, 0x9a, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xd0,
    0x3f, 0xa5, 0x01, 0x40, 0x42, 0x0f, 0x00, 0xa9, 0x01, 0x9a, 0x99, 0x99, 0x99, 0x99, 0x99, 0xa9,
    0x3f, 0xb5, 0x01, 0x01, 0x00, 0x00, 0x00, 0xfd, 0x7f, 0x5c, 0x43, 0x09, 0x41};

Packet<1> golden_packet() {
  Packet<1> p{.session = 0xA1B2C3D4,
              .seq = 7,
              .send_time_ns = 123456789012,
              .echo_session = 0x01020304,
              .echo_seq = 5,
              .echo_send_time_ns = -2,
              .echo_dwell_ns = 1500000,
              .expiry_ms = 2000,
              .state = StationState::kEngaged,
              .limits = kLimitTorque | kLimitDevice,
              .motion = {},
              .previous_age_ns = 1000000,
              .friction = 0.05,
              .friction_known = true};
  p.previous.x[0] = 0.5;
  p.previous.v[0] = -1.0;
  p.previous.f[0] = 0.25;
  p.motion.x[0] = 0.5;
  p.motion.v[0] = -1.25;
  p.motion.f[0] = 0.1;
  return p;
}

TEST(Crc32c, HasTheCheckValueOfCastagnoli) {
  EXPECT_EQ(crc32c(std::as_bytes(std::span("123456789").first<9>())), 0xE3069283u);
  EXPECT_EQ(crc32c({}), 0u);
}

TEST(Codec, WritesTheBytesOfAnIndependentEncoding) {
  PacketCodec<1> codec;
  const auto bytes = codec.encode(golden_packet());
  ASSERT_EQ(bytes.size(), sizeof kGolden);
  EXPECT_EQ(std::memcmp(bytes.data(), kGolden, sizeof kGolden), 0);
  Packet<1> decoded;
  ASSERT_EQ(codec.decode(std::as_bytes(std::span(kGolden)), decoded), DecodeResult::kOk);
  expect_equal(decoded, golden_packet());
  EXPECT_EQ(decoded.previous_age_ns, 0u) << "not told";
}

TEST(Codec, WritesTheBytesOfAnIndependentEncodingWithThePreviousSample) {
  PacketCodec<1> codec({.previous = true});
  const auto bytes = codec.encode(golden_packet());
  constexpr std::size_t kBefore = sizeof kGolden - 6 - 16;  // checksum and friction stand behind
  ASSERT_EQ(bytes.size(), kBefore + sizeof kGoldenPrevious);
  EXPECT_EQ(std::memcmp(bytes.data(), kGolden, kBefore), 0);
  EXPECT_EQ(std::memcmp(bytes.data() + kBefore, kGoldenPrevious, sizeof kGoldenPrevious), 0);
  Packet<1> decoded;
  ASSERT_EQ(codec.decode(bytes, decoded), DecodeResult::kOk);
  expect_equal(decoded, golden_packet());
  expect_equal_previous(decoded, golden_packet());
}

template <int N>
void round_trip(PacketParts parts, std::uint64_t seed, int cases) {
  using Codec = PacketCodec<N>;
  Codec sender(parts), receiver(parts);
  for (int i = 0; i < cases; ++i) {
    const Packet<N> packet = random_packet<N>(seed);
    const auto bytes = sender.encode(packet);
    ASSERT_EQ(bytes.size(),
              Codec::kSize + (parts.energy ? Codec::kEnergyBytes : 0) + (parts.previous ? Codec::kPreviousBytes : 0));
    Packet<N> decoded;
    ASSERT_EQ(receiver.decode(bytes, decoded), DecodeResult::kOk) << i;
    expect_equal(decoded, packet);
    EXPECT_EQ(decoded.energy, parts.energy ? packet.energy : 0.0);
    if (parts.previous) {
      expect_equal_previous(decoded, packet);
    } else {
      expect_equal_previous(decoded, Packet<N>{});
    }
  }
}
TEST(Codec, GivesBackWhatItWasGiven) {
  for (const bool energy : {false, true}) {
    for (const bool previous : {false, true}) {
      round_trip<1>({energy, previous}, 1, 20000);
      round_trip<2>({energy, previous}, 2, 20000);
    }
  }
}

TEST(Codec, PacketsWithOtherPartsAreRejected) {
  std::vector<PacketParts> all;
  for (const bool energy : {false, true}) {
    for (const bool previous : {false, true}) all.push_back({energy, previous});
  }
  for (std::size_t sent = 0; sent < all.size(); ++sent) {
    for (std::size_t expected = 0; expected < all.size(); ++expected) {
      PacketCodec<1> sender(all[sent]), receiver(all[expected]);
      Packet<1> out;
      EXPECT_EQ(receiver.decode(sender.encode(golden_packet()), out),
                sent == expected ? DecodeResult::kOk : DecodeResult::kSize);
    }
  }
}

TEST(Codec, SizeDoesNotDependOnValues) {
  PacketCodec<2> codec;
  Packet<2> p;
  EXPECT_EQ(codec.encode(p).size(), 139u);
  p = {.session = ~0u,
       .seq = ~0u,
       .send_time_ns = std::numeric_limits<Nanoseconds>::min(),
       .echo_session = ~0u,
       .echo_seq = ~0u,
       .echo_send_time_ns = std::numeric_limits<Nanoseconds>::max(),
       .echo_dwell_ns = ~0u,
       .expiry_ms = ~0u,
       .state = StationState::kFault,
       .limits = kAllLimits,
       .motion = {}};
  p.motion.x << kMax, -kMax;
  p.motion.v << std::numeric_limits<double>::denorm_min(), -0.0;
  p.motion.f << 0.0, -std::numeric_limits<double>::min();
  const auto bytes = codec.encode(p);
  EXPECT_EQ(bytes.size(), 139u);
  Packet<2> decoded;
  ASSERT_EQ(codec.decode(bytes, decoded), DecodeResult::kOk);
  expect_equal(decoded, p);
  EXPECT_TRUE(std::signbit(decoded.motion.v[1]));
}

TEST(Codec, RejectsEveryOtherSize) {
  PacketCodec<2> codec;
  std::vector<std::byte> bytes = copy(codec.encode(Packet<2>{}));
  Packet<2> out;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(codec.decode(std::span(bytes).first(size), out), DecodeResult::kSize) << size;
  }
  for (int extra = 0; extra < 200; ++extra) {
    bytes.push_back(std::byte{0});
    EXPECT_EQ(codec.decode(bytes, out), DecodeResult::kSize) << extra;
  }
}

TEST(Codec, RejectsEverySingleAndDoubleBitFlip) {
  for (const bool previous : {false, true}) {
    PacketCodec<1> codec({.previous = previous});
    std::vector<std::byte> bytes = copy(codec.encode(golden_packet()));
    const std::vector<std::byte> good = bytes;
    Packet<1> out;
    out.seq = 4711;
    const auto flip = [&](std::size_t bit) { bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8); };
    const std::size_t bits = 8 * bytes.size();
    for (std::size_t a = 0; a < bits; ++a) {
      flip(a);
      ASSERT_NE(codec.decode(bytes, out), DecodeResult::kOk) << a;
      for (std::size_t b = 0; b < a; ++b) {
        flip(b);
        ASSERT_NE(codec.decode(bytes, out), DecodeResult::kOk) << a << ' ' << b;
        flip(b);
      }
      flip(a);
    }
    EXPECT_EQ(out.seq, 4711u);  // never written
    EXPECT_EQ(bytes, good);
    EXPECT_EQ(codec.decode(bytes, out), DecodeResult::kOk);
  }
}

TEST(Codec, RejectsNonFiniteMotionBehindAValidChecksum) {
  PacketCodec<2> codec({.previous = true});
  for (const double bad : {kNan, kInf, -kInf, -kNan}) {
    for (int field = 0; field < 12; ++field) {
      Packet<2> p;
      Motion<2>& motion = field < 6 ? p.motion : p.previous;
      (field % 6 < 2 ? motion.x : field % 6 < 4 ? motion.v : motion.f)[field % 2] = bad;
      Packet<2> out;
      EXPECT_EQ(codec.decode(codec.encode(p), out), DecodeResult::kNotFinite) << field;
    }
    Packet<2> p, out;
    p.friction = bad;
    EXPECT_EQ(codec.decode(codec.encode(p), out), DecodeResult::kNotFinite);
  }
}

TEST(Codec, RejectsUnknownStatesLimitsAndFlags) {
  PacketCodec<1> codec;
  Packet<1> out;
  for (unsigned state = 0; state < 256; ++state) {
    Packet<1> p;
    p.state = static_cast<StationState>(state);
    EXPECT_EQ(codec.decode(codec.encode(p), out), state <= 10 ? DecodeResult::kOk : DecodeResult::kValue) << state;
  }
  for (unsigned bit = 0; bit < 32; ++bit) {
    Packet<1> p;
    p.limits = 1u << bit;
    const bool known = bit % 16 < 12 || bit == 12 || bit == 13;  // those that act or are near; a gap of the network
    EXPECT_EQ(codec.decode(codec.encode(p), out), known ? DecodeResult::kOk : DecodeResult::kValue) << bit;
  }
  for (unsigned flag = 0; flag < 256; ++flag) {
    std::vector<std::byte> bytes = copy(codec.encode(Packet<1>{}));
    bytes[bytes.size() - 10] = static_cast<std::byte>(flag);
    seal(bytes);
    EXPECT_EQ(codec.decode(bytes, out), flag <= 1 ? DecodeResult::kOk : DecodeResult::kValue) << flag;
  }
}

TEST(Codec, NamesAnotherVersionWhateverItsSize) {
  PacketCodec<1> codec;
  const std::vector<std::byte> good = copy(codec.encode(golden_packet()));
  Packet<1> out;
  std::vector<std::byte> other = good;
  other[1] = static_cast<std::byte>(kProtocolVersion + 1);
  EXPECT_EQ(codec.decode(other, out), DecodeResult::kChecksum);  // damaged, not another version
  seal(other);
  EXPECT_EQ(codec.decode(other, out), DecodeResult::kVersion);
  other.insert(other.end() - 6, std::byte{0});
  seal(other);
  EXPECT_EQ(codec.decode(other, out), DecodeResult::kVersion);
  std::vector<std::byte> longer = good;
  longer.insert(longer.end() - 6, std::byte{0});
  seal(longer);
  EXPECT_EQ(codec.decode(longer, out), DecodeResult::kSize);
  std::vector<std::byte> layout = good;
  layout[5] = std::byte{0x1d};
  seal(layout);
  EXPECT_EQ(codec.decode(layout, out), DecodeResult::kFormat);
}

TEST(Codec, PacketsForAnotherNumberOfJointsAreRejected) {
  PacketCodec<1> one;
  PacketCodec<2> two;
  Packet<1> out_1;
  Packet<2> out_2;
  EXPECT_EQ(one.decode(two.encode(Packet<2>{}), out_1), DecodeResult::kSize);
  EXPECT_EQ(two.decode(one.encode(Packet<1>{}), out_2), DecodeResult::kSize);
}

TEST(Codec, RejectsRandomBytesOfEverySizeAndWithEveryLayoutByteInPlace) {
  PacketCodec<2> codec;
  const std::vector<std::byte> good = copy(codec.encode(Packet<2>{}));
  std::uint64_t seed = 3;
  std::vector<std::byte> bytes;
  Packet<2> out;
  for (int i = 0; i < 100000; ++i) {
    bytes.resize(i % 2 ? good.size() : split_mix(seed) % 300);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(split_mix(seed));
    ASSERT_NE(codec.decode(bytes, out), DecodeResult::kOk) << i;
  }
  // Random values inside the right layout reach the checksum, which passes once in 2^32.
  int checksum = 0;
  for (int i = 0; i < 20000; ++i) {
    Packet<2> p = random_packet<2>(seed);
    bytes = copy(codec.encode(p));
    for (std::size_t k = 0; k < 4; ++k) bytes[bytes.size() - 4 + k] = static_cast<std::byte>(split_mix(seed));
    checksum += codec.decode(bytes, out) == DecodeResult::kChecksum;
  }
  EXPECT_EQ(checksum, 20000);
}

TEST(Codec, TouchesNeitherHeapNorMutexAfterItsConstruction) {
  if (kCounterIsBlind) GTEST_SKIP() << "the sanitizer brings its own malloc";
  PacketCodec<2> codec;
  std::uint64_t seed = 4;
  Packet<2> out;
  std::array<std::byte, PacketCodec<2>::kSize> damaged;
  int good = 0;
  const TouchCounter counter;
  for (int i = 0; i < 10000; ++i) {
    const auto bytes = codec.encode(random_packet<2>(seed));
    std::copy(bytes.begin(), bytes.end(), damaged.begin());
    good += codec.decode(bytes, out) == DecodeResult::kOk;
    damaged[split_mix(seed) % damaged.size()] ^= std::byte{1};
    good += codec.decode(damaged, out) == DecodeResult::kOk;
  }
  const Touched touched = counter.since();
  EXPECT_EQ(touched.heap, 0u);
  EXPECT_EQ(touched.locks, 0u);
  EXPECT_EQ(good, 10000);

  const TouchCounter deliberate;
  delete new volatile int(1);
  EXPECT_EQ(deliberate.since().heap, 2u) << "the counter is blind";
}

}  // namespace
}  // namespace farhand
