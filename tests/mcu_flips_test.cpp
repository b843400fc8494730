// What damage on the serial line can do. Up to two flipped bits are shown to be seen in every frame that there is, by
// cases; then frames by the hundred million say the same.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/mcu_params.hpp"

namespace farhand::mcu {
namespace {

using Wire = std::array<std::uint8_t, kWireBytes>;
using Nine = std::array<std::uint8_t, kWireBytes - 1>;

// Where a frame whose decoded bytes are zero at the positions 1 to 8 of `zeros` (bit p-1) has its pointers: from 0 over
// these to 9, each the distance to the next; 0 elsewhere.
Nine pointers(unsigned zeros) {
  Nine at{};
  std::uint8_t next = 9;
  for (int p = 8; p >= 0; --p) {
    if (p > 0 && (zeros >> (p - 1) & 1) == 0) continue;
    at[static_cast<std::size_t>(p)] = static_cast<std::uint8_t>(next - p);
    next = static_cast<std::uint8_t>(p);
  }
  return at;
}

// The CRC is linear: that of two frames differs by this, whatever they are.
std::uint16_t crc_of_error(const Nine& error) {
  const std::uint8_t none[kDecodedBytes] = {};
  return crc16(error.data() + 1, kDecodedBytes) ^ crc16(none, kDecodedBytes);
}

// Is there a frame with these zeros and these bytes that become pointers, whose own CRC is right? The other bytes may
// be what they like but 0, before and after.
bool frame_exists(const Nine& was, const Nine& now, const Nine& flips, Nine decoded = {}, std::size_t p = 1) {
  if (p == 9) return crc16(decoded.data() + 1, kDecodedBytes) == 0;
  if (was[p] != 0 || now[p] != 0) {
    decoded[p] = was[p] != 0 ? 0 : static_cast<std::uint8_t>(now[p] ^ flips[p]);
    return frame_exists(was, now, flips, decoded, p + 1);
  }
  for (unsigned value = 1; value < 256; ++value) {
    decoded[p] = static_cast<std::uint8_t>(value);
    if (value != flips[p] && frame_exists(was, now, flips, decoded, p + 1)) return true;
  }
  return false;
}

struct Undetected {
  long cases = 0, blind = 0, undetected = 0;  // blind: the CRC would not see it
};

// All frames, sorted by where their decoded zeros are before (old) and after (now) the damage. Where both have a
// pointer the flips are known; a byte that becomes a pointer held just what makes it one; the rest of the flips may be
// anywhere. The error that the CRC sees follows from these alone, so that nothing else of the frame matters.
void flip_rest(const Nine& was, const Nine& now, unsigned first_bit, int rest, Nine flips, Undetected& found) {
  Nine error{};
  bool possible = true;
  for (std::size_t p = 1; p < 9; ++p) {
    if (was[p] != 0 && now[p] != 0) continue;
    error[p] = static_cast<std::uint8_t>((was[p] | now[p]) ^ flips[p]);
    // A byte of the wire is never 0, before or after: what becomes a pointer, what was one.
    if ((was[p] | now[p]) != 0 && error[p] == 0) possible = false;
  }
  if (possible && flips != Nine{}) {
    ++found.cases;
    if (crc_of_error(error) == 0) {
      ++found.blind;
      if (frame_exists(was, now, flips)) ++found.undetected;
    }
  }
  if (rest == 0) return;
  for (unsigned bit = first_bit; bit < 72; ++bit) {
    const std::size_t p = bit / 8;
    if (p == 0 || (was[p] != 0 && now[p] != 0)) continue;  // these are known already
    flips[p] ^= static_cast<std::uint8_t>(1 << bit % 8);
    flip_rest(was, now, bit + 1, rest - 1, flips, found);
    flips[p] ^= static_cast<std::uint8_t>(1 << bit % 8);
  }
}

Undetected flips_in_all_frames(int most) {
  Undetected found;
  for (unsigned old_zeros = 0; old_zeros < 256; ++old_zeros) {
    for (unsigned new_zeros = 0; new_zeros < 256; ++new_zeros) {
      const Nine was = pointers(old_zeros), now = pointers(new_zeros);
      Nine flips{};
      int known = 0;
      for (std::size_t p = 0; p < 9; ++p) {
        if (was[p] == 0 || now[p] == 0) continue;
        flips[p] = was[p] ^ now[p];
        known += std::popcount(flips[p]);
      }
      if (known <= most) flip_rest(was, now, 0, most - known, flips, found);
    }
  }
  return found;
}

// Flips that make or unmake a 0x00 need no CRC: what is then between two zeros is never nine bytes long, because a
// frame and its neighbour together are longer by at least one, and a part of a frame is shorter.
TEST(McuFlips, NoFrameThereIsHidesOneOrTwoFlippedBits) {
  for (const int most : {1, 2}) {
    const Undetected found = flips_in_all_frames(most);
    std::printf("up to %d flips: %ld cases; %ld that the CRC does not see, in %ld of which there is such a frame\n",
                most, found.cases, found.blind, found.undetected);
    EXPECT_EQ(found.undetected, 0);
  }
}

// The cases above are what frames do: each frame tried falls under one of them.
TEST(McuFlips, TheCasesAreComplete) {
  std::mt19937 random(8);
  for (int n = 0; n < 200'000; ++n) {
    std::array<std::uint8_t, kPayloadBytes> payload{};
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random());
    Wire wire;
    encode_frame(payload.data(), wire.data());
    unsigned zeros = 0;
    const std::uint16_t crc = crc16(payload.data(), kPayloadBytes);
    for (unsigned p = 1; p <= 8; ++p) {
      const unsigned byte = p <= 6 ? payload[p - 1] : p == 7 ? crc >> 8 : crc & 0xFF;
      if (byte == 0) zeros |= 1u << (p - 1);
    }
    const Nine at = pointers(zeros);
    for (std::size_t p = 0; p < 9; ++p) {
      if (at[p] != 0) {
        ASSERT_EQ(wire[p], at[p]);
      } else {
        ASSERT_EQ(wire[p], p <= 6 ? payload[p - 1] : p == 7 ? crc >> 8 : crc & 0xFF);
      }
    }
  }
}

TEST(NightlyMcuFlips, AHundredMillionFlippedFramesAreAllRejected) {
  std::mt19937 random(12);
  long cases = 0, accepted = 0;
  FrameDecoder decoder;
  while (cases < 100'000'000) {
    std::array<std::uint8_t, kPayloadBytes> payload{};
    const auto zeros_in_ten = random() % 10;
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random() % 10 < zeros_in_ten ? 0 : random());
    Wire sent;
    encode_frame(payload.data(), sent.data());
    for (unsigned first = 0; first < 80; ++first) {
      for (unsigned second = first; second < 80; ++second) {  // equal: a single flip
        Wire hit = sent;
        hit[first / 8] ^= static_cast<std::uint8_t>(1 << first % 8);
        if (second != first) hit[second / 8] ^= static_cast<std::uint8_t>(1 << second % 8);
        for (const std::uint8_t byte : hit) accepted += decoder.push(byte);
        decoder.push(0);
        ++cases;
      }
    }
  }
  std::printf("%ld flipped frames, %ld accepted\n", cases, accepted);
  EXPECT_EQ(accepted, 0);
}

// Well-formed frames of random content: COBS as it should be, CRC by chance.
class RandomFrames {
 public:
  explicit RandomFrames(std::uint32_t seed) : random_(seed) {}
  const Wire& next() {
    std::uint64_t bits = random_();
    int zero_at = 9;
    for (int i = 8; i >= 1; --i, bits >>= 8) wire_[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(bits);
    for (int i = 8; i >= 0; --i) {
      auto& byte = wire_[static_cast<std::size_t>(i)];
      if (i == 0 || byte == 0) byte = static_cast<std::uint8_t>(zero_at - i), zero_at = i;
    }
    return wire_;
  }

 private:
  std::mt19937_64 random_;
  Wire wire_{};
};

std::vector<Wire> accepted_of(long frames, std::uint32_t seed) {
  RandomFrames random(seed);
  FrameDecoder decoder;
  std::vector<Wire> accepted;
  for (long n = 0; n < frames; ++n) {
    const Wire& wire = random.next();
    bool passed = false;
    for (const std::uint8_t byte : wire) passed = decoder.push(byte);
    if (passed) accepted.push_back(wire);
  }
  EXPECT_EQ(decoder.framing_errors(), 0);
  const double expected = static_cast<double>(frames) / 65536;  // Poisson
  std::printf("%ld well-formed random frames: %zu passed, %.0f +- %.0f (3 sigma) expected\n", frames, accepted.size(),
              expected, 3 * std::sqrt(expected));
  EXPECT_NEAR(static_cast<double>(accepted.size()), expected, 3 * std::sqrt(expected));
  return accepted;
}

class Host {
 public:
  Host() : core(make_mcu_params({})) {}
  void send(const Wire& wire) {
    for (const std::uint8_t byte : wire) core.receive(byte);
  }
  McuOutput frame(Mode mode) {
    Wire wire;
    encode(make_command(mode, seq++, 0, 0, 0), wire.data());
    send(wire);
    core.step({0, 0, 25, false});
    return core.step({0, 0, 25, false});
  }
  OrthosisMcu core;
  std::uint8_t seq = 0;
};

// Each that passed, given to a core that tracks, to one that stands ready to start and to one that never heard SAFE.
void feed(const std::vector<Wire>& accepted) {
  const McuSettings s;
  const double x_step = s.velocity_limit * 1e-3, v_step = s.acceleration_limit * 1e-3,
               f_step = s.force_rate_limit * 1e-3;
  const double tau_step = s.torque_rate_limit / s.loop_hz;
  Host tracking, ready, fresh;
  ready.frame(Mode::kSafe);
  for (int k = 0; k < 100; ++k) tracking.frame(k < 2 ? Mode::kSafe : Mode::kTrack);
  ASSERT_EQ(tracking.frame(Mode::kTrack).state, State::kTrack);
  for (const Wire& wire : accepted) {
    Host hit = tracking;
    hit.send(wire);
    ASSERT_LE(std::abs(to_rad(hit.core.x_command() - tracking.core.x_command())), x_step + 1e-7);
    ASSERT_LE(std::abs(to_rad_s(hit.core.v_command() - tracking.core.v_command())), v_step + 1e-5);
    ASSERT_LE(std::abs(to_nm(hit.core.f_command() - tracking.core.f_command())), f_step + 1e-6);
    double tau = to_nm(hit.core.torque_command());
    for (int k = 0; k < 39; ++k) {
      const State state = hit.core.step({0, 0, 25, false}).state;
      ASSERT_TRUE(state == State::kTrack || state == State::kSafe);
      ASSERT_LE(std::abs(to_nm(hit.core.torque_command()) - tau), tau_step + 1e-6);
      tau = to_nm(hit.core.torque_command());
    }
    for (Host host : {ready, fresh}) {
      host.send(wire);
      for (int k = 0; k < 10; ++k) ASSERT_EQ(host.core.step({0, 0, 25, false}).state, State::kSafe);
      ASSERT_EQ(host.core.torque_command(), 0);
    }
  }
}

TEST(McuFlips, ARandomFramePassesOnceIn65536MovesEachReferenceByOneStepAndLeavesSafeNever) {
  feed(accepted_of(1 << 22, 5));
}
TEST(NightlyMcuFlips, ARandomFramePassesOnceIn65536MovesEachReferenceByOneStepAndLeavesSafeNever) {
  feed(accepted_of(1 << 27, 6));
}

}  // namespace
}  // namespace farhand::mcu
