// The frames between the patient's PC and the orthosis MCU: six payload bytes and a CRC-16, COBS-coded, closed by 0x00.
// That is ten bytes, the most that 115200 baud carry in the millisecond between two frames. Firmware and PC compile the
// same source; therefore it is freestanding C++14 without floating point. The PC's side in SI is
// common/device/mcu_si.hpp.
#pragma once

#include <stdint.h>

namespace farhand {
namespace mcu {

enum : uint8_t { kPayloadBytes = 6, kDecodedBytes = 8, kWireBytes = 10 };

// Scales. Those of the command are powers of two, so that the MCU converts by shifting. A 14-bit reference then spans
// +-1 rad, +-8 rad/s and +-4 N m; telemetry spans +-3.27 rad and +-3.27 N m.
constexpr int32_t kXRefCountsPerRad = 8192;          // 0.122 mrad
constexpr int32_t kVRefCountsPerRadPerS = 1024;      // 0.977 mrad/s
constexpr int32_t kFRefCountsPerNm = 2048;           // 0.488 mN m
constexpr int32_t kAngleCountsPerRad = 10000;        // 0.1 mrad
constexpr int32_t kTorqueCountsPerNm = 10000;        // 0.1 mN m
constexpr int32_t kMotorSpeedCountsPerRadPerS = 16;  // slow byte, +-7.9 rad/s
constexpr int32_t kCurrentCountsPerA = 64;           // slow byte, up to 3.98 A
constexpr int16_t kRefLimit = 8191;
// As f_ref of a SAFE frame, which no force can be: let go as fast as the patient's stop does.
constexpr int16_t kStopNow = -8192;

// Mode that the PC asks for. CONFIG is reserved for parameter pages; the core ignores such frames.
enum class Mode : uint8_t { kSafe = 0, kTrack = 1, kTorque = 2, kConfig = 3 };
// State of the MCU. While its torque ramps down it still reports the state that it leaves. FAULT is reported at once,
// for a fault or the patient's stop; the page of faults shows which.
enum class State : uint8_t { kSafe = 0, kTrack = 1, kTorque = 2, kFault = 3 };

struct Command {
  Mode mode = Mode::kSafe;
  uint8_t seq = 0;  // 4 bit
  int16_t x_ref = 0, v_ref = 0, f_ref = 0;
};

struct Telemetry {
  State state = State::kSafe;
  uint8_t seq = 0;     // 6 bit
  int16_t angle = 0;   // joint
  int16_t torque = 0;  // f_s of the reaction torque observer
  uint8_t slow = 0;    // one byte of the page slow_page(seq)
};

// The sequence number decides the meaning of the slow byte. A high byte and the low byte after it belong to one sample.
// Counters wrap.
enum class SlowPage : uint8_t {
  kSpringTorqueHigh,
  kSpringTorqueLow,
  kMotorAngleHigh,
  kMotorAngleLow,
  kMotorSpeedCommand,
  kTemperatureC,
  kFaults,
  kCrcErrors,
  kFramingErrors,
  kOverruns,
  kFirmware,
  kCommandEcho,  // newest command: mode in bits 4-5, seq below; events since the last such page: Happened
  kRestart,      // cause of the last start, bits 0-3; number of restarts, bits 4-7
  kCurrent,
  kNumberHigh,  // bits 4-11 of the newest command's number,
  kNumberLow,   // bits 0-7, a frame later: each is of the newest command when its frame is made
};
// Bits beside the echo of a command.
enum Happened : uint8_t {
  kBounded = 64,  // the bound at the hand reduced the torque that was asked for
  kSagged = 128,  // silence made the MCU let go; it is SAFE if the silence lasted
};
// Bits of the fault page. All but kWatchdog keep the MCU out of the active states: kPatientStop until it is released,
// the others until the MCU is reset.
enum Fault : uint8_t {
  kJointEncoder = 1,
  kMotorEncoder = 2,
  kSpringTorque = 4,
  kOverrun = 8,
  kWatchdog = 16,  // silence ended the last active state; cleared by the next start
  kPatientStop = 32,
  kSpringSensor = 64,  // the spring's sensor and the encoders disagree: one of them, or the spring, is broken
};

// A command's number has 12 bits, so that an age of up to 4 s is unambiguous. Every frame carries the lowest four as
// seq. A SAFE frame, whose references are not used, also carries the upper eight, as x_ref. In an active mode the MCU
// counts on.
constexpr uint16_t kNumbers = 4096;
inline void set_number(Command& command, uint16_t number) {
  command.seq = number & 15;
  if (command.mode == Mode::kSafe) command.x_ref = static_cast<int16_t>((number >> 4) & 0xFF);
}
inline uint16_t number_of(const Command& command, uint16_t before) {
  if (command.mode == Mode::kSafe) return static_cast<uint16_t>(((command.x_ref & 0xFF) << 4) | command.seq);
  return static_cast<uint16_t>(before + ((command.seq - before) & 15));
}

inline SlowPage slow_page(uint8_t telemetry_seq) { return static_cast<SlowPage>(telemetry_seq & 15); }

// Polynomial 0x3D65 has Hamming distance 6 at this length (the common 0x1021: 4): up to five flipped bits are always
// detected. Without a final xor the CRC over payload and CRC is 0.
struct CrcTable {
  uint16_t of_byte[256];
};
constexpr CrcTable make_crc_table() {
  CrcTable table{};
  for (uint16_t n = 0; n < 256; ++n) {
    uint16_t crc = static_cast<uint16_t>(n << 8);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = static_cast<uint16_t>((crc & 0x8000) ? (static_cast<uint16_t>(crc << 1) ^ 0x3D65) : (crc << 1));
    }
    table.of_byte[n] = crc;
  }
  return table;
}
constexpr CrcTable kCrcTable = make_crc_table();
inline uint16_t crc16(const uint8_t* bytes, uint8_t count) {
  uint16_t crc = 0xFFFF;
  for (uint8_t i = 0; i < count; ++i) {
    const uint8_t index = static_cast<uint8_t>((crc >> 8) ^ bytes[i]);
    crc = static_cast<uint16_t>((crc << 8) ^ kCrcTable.of_byte[index]);
  }
  return crc;
}

// Payload to wire: adds the CRC, replaces zeros (COBS), ends with 0x00.
inline void encode_frame(const uint8_t payload[kPayloadBytes], uint8_t wire[kWireBytes]) {
  const uint16_t crc = crc16(payload, kPayloadBytes);
  for (uint8_t i = 0; i < kPayloadBytes; ++i) wire[i + 1] = payload[i];
  wire[7] = static_cast<uint8_t>(crc >> 8);
  wire[8] = static_cast<uint8_t>(crc & 0xFF);
  wire[9] = 0;
  uint8_t next_zero = 9;
  for (uint8_t i = 9; i-- > 0;) {
    if (i == 0 || wire[i] == 0) {
      wire[i] = static_cast<uint8_t>(next_zero - i);
      next_zero = i;
    }
  }
}

// Decodes payloads from the bytes of the wire. Garbage destroys at most the frame that it hit and the next one;
// decoding starts anew after the next 0x00. A single 0x00 is ignored, so that a sender may put one in front of a frame.
class FrameDecoder {
 public:
  // Returns true if this byte completed a valid frame; payload() holds it until the next call.
  bool push(uint8_t byte) {
    if (byte != 0) {
      if (count_ < kWireBytes - 1) bytes_[count_] = byte;
      if (count_ < kWireBytes) ++count_;  // stays there: too long
      return false;
    }
    const uint8_t count = count_;
    count_ = 0;
    if (count == 0) return false;
    if (count != kWireBytes - 1 || !uncobs()) {
      ++framing_errors_;
      return false;
    }
    if (crc16(bytes_ + 1, kDecodedBytes) != 0) {
      ++crc_errors_;
      return false;
    }
    return true;
  }

  const uint8_t* payload() const { return bytes_ + 1; }
  uint16_t crc_errors() const { return crc_errors_; }          // wraps
  uint16_t framing_errors() const { return framing_errors_; }  // wrong length or broken COBS chain; wraps

 private:
  // The chain of zero positions must end exactly behind the last byte. No byte here is 0, so the chain always advances.
  bool uncobs() {
    uint16_t next_zero = bytes_[0];
    for (uint8_t i = 1; i < kWireBytes - 1; ++i) {
      if (i != next_zero) continue;
      next_zero = static_cast<uint16_t>(i + bytes_[i]);
      bytes_[i] = 0;
    }
    return next_zero == kWireBytes - 1;
  }

  uint8_t bytes_[kWireBytes - 1] = {};
  uint8_t count_ = 0;
  uint16_t crc_errors_ = 0;
  uint16_t framing_errors_ = 0;
};

inline int16_t saturate_ref(int32_t counts) {
  return static_cast<int16_t>(counts > kRefLimit ? kRefLimit : counts < kStopNow ? kStopNow : counts);
}

// Command payload, most significant bit first: mode 2, seq 4, x_ref 14, v_ref 14, f_ref 14.
inline void pack(const Command& command, uint8_t payload[kPayloadBytes]) {
  const uint16_t x = static_cast<uint16_t>(saturate_ref(command.x_ref)) & 0x3FFF;
  const uint16_t v = static_cast<uint16_t>(saturate_ref(command.v_ref)) & 0x3FFF;
  const uint16_t f = static_cast<uint16_t>(saturate_ref(command.f_ref)) & 0x3FFF;
  payload[0] = static_cast<uint8_t>((static_cast<uint8_t>(command.mode) << 6) | ((command.seq & 15) << 2) | (x >> 12));
  payload[1] = static_cast<uint8_t>((x >> 4) & 0xFF);
  payload[2] = static_cast<uint8_t>(((x & 0xF) << 4) | (v >> 10));
  payload[3] = static_cast<uint8_t>((v >> 2) & 0xFF);
  payload[4] = static_cast<uint8_t>(((v & 3) << 6) | (f >> 8));
  payload[5] = static_cast<uint8_t>(f & 0xFF);
}

inline Command unpack_command(const uint8_t payload[kPayloadBytes]) {
  // Sign extension of 14 bits without shifting a negative number.
  struct Extend {
    static int16_t from(uint16_t low14) { return static_cast<int16_t>((low14 & 0x3FFF) - ((low14 & 0x2000) << 1)); }
  };
  Command command;
  command.mode = static_cast<Mode>(payload[0] >> 6);
  command.seq = (payload[0] >> 2) & 15;
  command.x_ref = Extend::from(static_cast<uint16_t>(((payload[0] & 3) << 12) | (payload[1] << 4) | (payload[2] >> 4)));
  command.v_ref =
      Extend::from(static_cast<uint16_t>(((payload[2] & 15) << 10) | (payload[3] << 2) | (payload[4] >> 6)));
  command.f_ref = Extend::from(static_cast<uint16_t>(((payload[4] & 63) << 8) | payload[5]));
  return command;
}

// Telemetry payload: state 2, seq 6, angle 16, torque 16, slow 8.
inline void pack(const Telemetry& telemetry, uint8_t payload[kPayloadBytes]) {
  const uint16_t angle = static_cast<uint16_t>(telemetry.angle);
  const uint16_t torque = static_cast<uint16_t>(telemetry.torque);
  payload[0] = static_cast<uint8_t>((static_cast<uint8_t>(telemetry.state) << 6) | (telemetry.seq & 63));
  payload[1] = static_cast<uint8_t>(angle >> 8);
  payload[2] = static_cast<uint8_t>(angle & 0xFF);
  payload[3] = static_cast<uint8_t>(torque >> 8);
  payload[4] = static_cast<uint8_t>(torque & 0xFF);
  payload[5] = telemetry.slow;
}

inline Telemetry unpack_telemetry(const uint8_t payload[kPayloadBytes]) {
  Telemetry telemetry;
  telemetry.state = static_cast<State>(payload[0] >> 6);
  telemetry.seq = payload[0] & 63;
  telemetry.angle = static_cast<int16_t>((static_cast<uint16_t>(payload[1]) << 8) | payload[2]);
  telemetry.torque = static_cast<int16_t>((static_cast<uint16_t>(payload[3]) << 8) | payload[4]);
  telemetry.slow = payload[5];
  return telemetry;
}

template <class Message>
void encode(const Message& message, uint8_t wire[kWireBytes]) {
  uint8_t payload[kPayloadBytes];
  pack(message, payload);
  encode_frame(payload, wire);
}

}  // namespace mcu
}  // namespace farhand
