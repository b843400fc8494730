// Serial frames of the orthosis MCU against vectors from an independent implementation (CRC by long division of
// polynomials, COBS by splitting at zeros), and against everything that a bad cable can do to them.
#include "common/device/mcu_frame.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "common/device/mcu_si.hpp"

namespace farhand::mcu {
namespace {

using Wire = std::array<std::uint8_t, kWireBytes>;
using Payload = std::array<std::uint8_t, kPayloadBytes>;

template <class Message>
Wire wire_of(const Message& message) {
  Wire wire;
  encode(message, wire.data());
  return wire;
}

Wire framed(const Payload& payload) {
  Wire wire;
  encode_frame(payload.data(), wire.data());
  return wire;
}

// Bytes are drawn so that zeros and other COBS codes are as frequent as in real references, not only as in noise.
Payload random_payload(std::mt19937& random) {
  Payload payload;
  for (auto& byte : payload) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() % 10 : random());
  return payload;
}

std::vector<Payload> decoded(FrameDecoder& decoder, const std::uint8_t* bytes, std::size_t count) {
  std::vector<Payload> out;
  for (std::size_t i = 0; i < count; ++i) {
    if (!decoder.push(bytes[i])) continue;
    Payload payload;
    std::copy_n(decoder.payload(), payload.size(), payload.begin());
    out.push_back(payload);
  }
  return out;
}

Command command_of(Mode mode, int seq, int x, int v, int f) {
  return {mode, static_cast<std::uint8_t>(seq), static_cast<std::int16_t>(x), static_cast<std::int16_t>(v),
          static_cast<std::int16_t>(f)};
}

Telemetry telemetry_of(State state, int seq, int angle, int torque, int slow) {
  return {state, static_cast<std::uint8_t>(seq), static_cast<std::int16_t>(angle), static_cast<std::int16_t>(torque),
          static_cast<std::uint8_t>(slow)};
}

TEST(Crc16, CheckValueOfThePolynomial) {
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc16(digits, 9), 0xBBB6);
}

TEST(McuFrame, CommandsEqualTheGoldenVectors) {
  EXPECT_EQ(wire_of(command_of(Mode::kSafe, 0, 0, 0, 0)),
            (Wire{0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x03, 0xA0, 0xB4, 0x00}));
  EXPECT_EQ(wire_of(command_of(Mode::kTrack, 5, 2048, -1024, 512)),
            (Wire{0x04, 0x54, 0x80, 0x0F, 0x02, 0x02, 0x03, 0xC6, 0x62, 0x00}));
  EXPECT_EQ(wire_of(command_of(Mode::kTorque, 15, -8191, 8191, -1)),
            (Wire{0x02, 0xBE, 0x07, 0x17, 0xFF, 0xFF, 0xFF, 0xCA, 0x39, 0x00}));
  EXPECT_EQ(wire_of(command_of(Mode::kTrack, 9, -1, 1, -8191)),
            (Wire{0x04, 0x67, 0xFF, 0xF0, 0x05, 0x60, 0x01, 0x34, 0x7F, 0x00}));
  EXPECT_EQ(wire_of(command_of(Mode::kConfig, 1, 4, 256, 0)),
            (Wire{0x02, 0xC4, 0x03, 0x40, 0x40, 0x01, 0x03, 0x70, 0x2D, 0x00}));
}

TEST(McuFrame, TelemetryEqualsTheGoldenVectors) {
  EXPECT_EQ(wire_of(telemetry_of(State::kTrack, 63, 2500, -12345, 0xA5)),
            (Wire{0x09, 0x7F, 0x09, 0xC4, 0xCF, 0xC7, 0xA5, 0x37, 0x7E, 0x00}));
  EXPECT_EQ(wire_of(telemetry_of(State::kFault, 17, -32768, 32767, 0)),
            (Wire{0x03, 0xD1, 0x80, 0x03, 0x7F, 0xFF, 0x03, 0x68, 0xA8, 0x00}));
  EXPECT_EQ(wire_of(telemetry_of(State::kTorque, 1, -1, 256, 1)),
            (Wire{0x05, 0x81, 0xFF, 0xFF, 0x01, 0x04, 0x01, 0xE3, 0x15, 0x00}));
}

TEST(McuFrame, EveryMessageComesBackAndNoZeroStandsBeforeTheEnd) {
  std::mt19937 random(1);
  FrameDecoder decoder;
  for (int i = 0; i < 100'000; ++i) {
    const auto ref = [&] { return static_cast<int>(random() % (2 * kRefLimit + 1)) - kRefLimit; };
    const Command sent =
        command_of(static_cast<Mode>(random() % 4), static_cast<int>(random() % 16), ref(), ref(), ref());
    const Wire wire = wire_of(sent);
    for (std::size_t k = 0; k + 1 < wire.size(); ++k) ASSERT_NE(wire[k], 0);
    ASSERT_EQ(wire.back(), 0);
    ASSERT_EQ(decoded(decoder, wire.data(), wire.size()).size(), 1u);
    const Command got = unpack_command(decoder.payload());
    ASSERT_TRUE(got.mode == sent.mode && got.seq == sent.seq);
    ASSERT_TRUE(got.x_ref == sent.x_ref && got.v_ref == sent.v_ref && got.f_ref == sent.f_ref);

    const Telemetry told = telemetry_of(static_cast<State>(random() % 4), static_cast<int>(random() % 64),
                                        static_cast<int>(random() % 65536) - 32768,
                                        static_cast<int>(random() % 65536) - 32768, static_cast<int>(random() % 256));
    const Wire reply = wire_of(told);
    for (std::size_t k = 0; k + 1 < reply.size(); ++k) ASSERT_NE(reply[k], 0);
    ASSERT_EQ(decoded(decoder, reply.data(), reply.size()).size(), 1u);
    const Telemetry heard = unpack_telemetry(decoder.payload());
    ASSERT_TRUE(heard.state == told.state && heard.seq == told.seq && heard.slow == told.slow);
    ASSERT_TRUE(heard.angle == told.angle && heard.torque == told.torque);
  }
  EXPECT_EQ(decoder.crc_errors() + decoder.framing_errors(), 0);
}

// A flip may destroy the 0x00, which costs the next frame too; the one after that must always get through, and nothing
// that was not sent may.
TEST(McuFrame, EverySingleAndDoubleBitFlipIsRejectedAndCounted) {
  std::mt19937 random(2);
  const Wire next = framed({0x55, 1, 2, 3, 4, 5}), last = framed({0xAA, 0, 0, 7, 0, 9});
  for (int n = 0; n < 2000; ++n) {
    const Wire sent = framed(random_payload(random));
    for (int first = 0; first < 80; ++first) {
      for (int second = first; second < 80; ++second) {  // equal: a single flip
        Wire hit = sent;
        hit[static_cast<std::size_t>(first / 8)] ^= static_cast<std::uint8_t>(1 << (first % 8));
        if (second != first) hit[static_cast<std::size_t>(second / 8)] ^= static_cast<std::uint8_t>(1 << (second % 8));
        FrameDecoder decoder;
        for (const std::uint8_t byte : hit) ASSERT_FALSE(decoder.push(byte)) << n << ' ' << first << ' ' << second;
        int passed = 0;
        for (const std::uint8_t byte : next) passed += decoder.push(byte);
        ASSERT_EQ(passed, hit.back() == 0 ? 1 : 0) << n << ' ' << first << ' ' << second;
        for (const std::uint8_t byte : last) passed += decoder.push(byte);
        ASSERT_EQ(passed, hit.back() == 0 ? 2 : 1);
        ASSERT_EQ(decoder.payload()[0], 0xAA);
        ASSERT_GE(decoder.crc_errors() + decoder.framing_errors(), 1);
      }
    }
  }
}

TEST(McuFrame, EveryTruncationIsRejectedAndCounted) {
  std::mt19937 random(3);
  for (int n = 0; n < 10'000; ++n) {
    const Wire sent = framed(random_payload(random));
    for (std::size_t keep = 1; keep < sent.size() - 1; ++keep) {
      FrameDecoder tail_lost, head_lost, zero_lost;
      for (std::size_t i = 0; i < keep; ++i) ASSERT_FALSE(tail_lost.push(sent[i]));
      ASSERT_FALSE(tail_lost.push(0));
      ASSERT_EQ(tail_lost.framing_errors(), 1);
      for (std::size_t i = keep; i < sent.size(); ++i) ASSERT_FALSE(head_lost.push(sent[i]));
      ASSERT_EQ(head_lost.framing_errors(), 1);
      for (std::size_t i = 0; i < keep; ++i) ASSERT_FALSE(zero_lost.push(sent[i]));
      for (const std::uint8_t byte : sent) ASSERT_FALSE(zero_lost.push(byte));
      ASSERT_EQ(zero_lost.framing_errors(), 1);
    }
  }
}

TEST(McuFrame, GarbageOfAnyLengthIsSurvived) {
  std::mt19937 random(4);
  FrameDecoder decoder;
  int false_accepts = 0;
  for (int n = 0; n < 50'000; ++n) {
    const auto garbage = random() % (n % 100 == 0 ? 1000 : 40);
    for (unsigned i = 0; i < garbage; ++i) false_accepts += decoder.push(static_cast<std::uint8_t>(random()));
    false_accepts += decoder.push(0);
    const Payload payload = random_payload(random);
    const Wire wire = framed(payload);
    const auto got = decoded(decoder, wire.data(), wire.size());
    ASSERT_EQ(got.size(), 1u);
    ASSERT_EQ(got[0], payload);
  }
  EXPECT_LE(false_accepts, 1);  // noise of exactly nine bytes with an intact chain and CRC: 2^-16 of a few per cent
  EXPECT_GT(decoder.framing_errors(), 10'000);
  EXPECT_GT(decoder.crc_errors(), 0);
}

TEST(McuFrame, AnIdleLineOfZerosIsNothing) {
  FrameDecoder decoder;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(decoder.push(0));
  EXPECT_EQ(decoder.crc_errors() + decoder.framing_errors(), 0);
}

// The vectors that any other MCU is checked with; scripts/check_mcu reads them with a codec of its own.
TEST(McuFrame, VectorsAreFramesAndRejectsAreNot) {
  std::ifstream file(FARHAND_MCU_VECTORS);
  std::map<std::string, int> kinds;
  for (std::string line; std::getline(file, line);) {
    line = line.substr(0, line.find('#'));
    const auto colon = line.find(':');
    if (colon == std::string::npos) continue;
    std::istringstream left(line.substr(0, colon)), right(line.substr(colon + 1));
    std::string kind;
    left >> kind;
    std::map<std::string, int> fields;
    for (std::string field; left >> field;) {
      fields[field.substr(0, field.find('='))] = std::stoi(field.substr(field.find('=') + 1));
    }
    Wire wire{};
    unsigned byte = 0;
    std::size_t count = 0;
    while (right >> std::hex >> byte) wire.at(count++) = static_cast<std::uint8_t>(byte);
    ASSERT_EQ(count, wire.size()) << line;
    ++kinds[kind];
    FrameDecoder decoder;
    const auto got = decoded(decoder, wire.data(), wire.size());
    if (kind == "rejected") {
      EXPECT_TRUE(got.empty()) << line;
      EXPECT_EQ(decoder.crc_errors() + decoder.framing_errors(), 1) << line;
      continue;
    }
    ASSERT_EQ(got.size(), 1u) << line;
    EXPECT_EQ(framed(got[0]), wire) << line;
    if (kind == "command") {
      const Command command = unpack_command(got[0].data());
      EXPECT_TRUE(static_cast<int>(command.mode) == fields["mode"] && command.seq == fields["seq"] &&
                  command.x_ref == fields["x"] && command.v_ref == fields["v"] && command.f_ref == fields["f"])
          << line;
    } else {
      EXPECT_EQ(kind, "telemetry");
      EXPECT_EQ(wire, wire_of(telemetry_of(static_cast<State>(fields["state"]), fields["seq"], fields["angle"],
                                           fields["torque"], fields["slow"])))
          << line;
    }
  }
  EXPECT_GE(kinds["command"], 20);
  EXPECT_GE(kinds["telemetry"], 10);
  EXPECT_GE(kinds["rejected"], 10);
}

TEST(McuSi, QuantisationErrorIsAtMostHalfACount) {
  std::mt19937 random(6);
  const auto uniform = [&](double limit) { return limit * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0); };
  for (int i = 0; i < 100'000; ++i) {
    const double x = uniform(0.9998), v = uniform(7.998), f = uniform(3.999);
    const Command command = make_command(Mode::kTrack, 1, x, v, f);
    ASSERT_LE(std::abs(command.x_ref / 8192.0 - x), 0.5 / 8192.0);  // 0.061 mrad
    ASSERT_LE(std::abs(command.v_ref / 1024.0 - v), 0.5 / 1024.0);
    ASSERT_LE(std::abs(command.f_ref / 2048.0 - f), 0.5 / 2048.0);  // 0.24 mN m
  }
}

TEST(McuSi, ReferencesOutsideTheRangeSaturate) {
  for (const double far : {1.0, 1e3, 1e300}) {
    const Command up = make_command(Mode::kTrack, 0, far, 8 * far, 4 * far);
    EXPECT_TRUE(up.x_ref == 8191 && up.v_ref == 8191 && up.f_ref == 8191);
    const Command down = make_command(Mode::kTrack, 0, -far, -8 * far, -4 * far);
    EXPECT_TRUE(down.x_ref == -8191 && down.v_ref == -8191 && down.f_ref == -8191);
  }
  const Command lowest = unpack_command(Payload{0x42, 0x00, 0x08, 0x00, 0x20, 0x00}.data());
  EXPECT_TRUE(lowest.x_ref == -8192 && lowest.v_ref == -8192 && lowest.f_ref == -8192);
}

TEST(McuSi, AReferenceThatIsNotFiniteAsksForSafe) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    for (int field = 0; field < 3; ++field) {
      const Command command =
          make_command(Mode::kTrack, 3, field == 0 ? bad : 0.1, field == 1 ? bad : 0.1, field == 2 ? bad : 0.1);
      EXPECT_EQ(command.mode, Mode::kSafe);
      EXPECT_EQ(command.x_ref, 0);
    }
  }
}

TEST(McuSi, SlowBytesAddUpAndAHalfPairIsNotUsed) {
  SlowValues values;
  const auto take = [&](int seq, int slow) { values.take(telemetry_of(State::kTrack, seq, 0, 0, slow)); };
  take(0, 0xD8), take(1, 0xF0), take(2, 0x09), take(3, 0xC4), take(4, 0xF0), take(5, 36), take(6, 3), take(11, 0x1D);
  EXPECT_DOUBLE_EQ(values.spring_torque_nm(), -1.0);
  EXPECT_DOUBLE_EQ(values.motor_angle_rad(), 0.25);
  EXPECT_DOUBLE_EQ(values.motor_speed_command_rad_s(), -1.0);
  EXPECT_EQ(values.temperature_c(), 36);
  EXPECT_EQ(values.faults(), 3);
  EXPECT_EQ(values.command_seq(), 13);
  take(16, 0x00), take(18, 0x00), take(19, 0x00);  // 17 lost: torque keeps its last whole sample
  EXPECT_DOUBLE_EQ(values.spring_torque_nm(), -1.0);
  EXPECT_DOUBLE_EQ(values.motor_angle_rad(), 0.0);
  take(27, 0x22);
  take(30, 0x24);  // the number has pages of its own
  take(27, 0x23);
  EXPECT_EQ(values.command_seq(), 3);
  take(28, 0x24), take(29, 96);
  EXPECT_EQ(values.restart(), 0x24);
  EXPECT_DOUBLE_EQ(values.motor_current_a(), 1.5);
  EXPECT_EQ(values.command_seq(), 3);
}

}  // namespace
}  // namespace farhand::mcu
