// The serial line to the MCU, its sensors and the patient's switches, any of them in any order: whatever comes, torque
// and references are bounded in size and step, silence and the patient's stop end it in time, and out of SAFE lead only
// a SAFE frame and three frames in a row. Raw bytes are mixed with frames whose CRC is mended.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "slave/mcu/mcu_params.hpp"
#include "tests/fuzz/targets.hpp"

namespace farhand::fuzz {
namespace {

using mcu::Command;
using mcu::Mode;
using mcu::State;

bool active(State state) { return state == State::kTrack || state == State::kTorque; }

mcu::McuParams params(std::uint8_t choice) {
  mcu::McuSettings s;
  if ((choice & 1) != 0) s.spring_sensor_nm = 8;
  if ((choice & 2) != 0) s.joint_counts_per_rev = s.motor_counts_per_rev = 0;
  if ((choice & 4) != 0) s.loop_hz = 4000;
  if ((choice & 8) != 0) s.encoder_speed_fault = 4000, s.spring_torque_fault = 15;  // wild angles reach the arithmetic
  return mcu::make_mcu_params(s);
}

// What must be true before the core may start, worked out from the frames that passed and the states that it showed.
class Permission {
 public:
  explicit Permission(int watchdog_loops) : watchdog_loops_(watchdog_loops) {}

  void frame(const Command& command, bool is_active) {
    if (command.mode == Mode::kConfig) return;
    loops_silent_ = 0;
    if (is_active) return;
    if (command.mode == Mode::kSafe) {
      safe_seen_ = true;
      in_a_row_ = 0;
      return;
    }
    const bool next = in_a_row_ > 0 && command.mode == last_.mode && command.seq == ((last_.seq + 1) & 15);
    in_a_row_ = next ? in_a_row_ + 1 : 1;
    last_ = command;
    if (safe_seen_ && in_a_row_ >= 3) given_ = true;
  }
  void loop(bool is_active, bool was_active) {
    ++loops_silent_;
    if (was_active && !is_active) safe_seen_ = given_ = false, in_a_row_ = 0;
    if (!is_active && loops_silent_ > watchdog_loops_) safe_seen_ = false, in_a_row_ = 0;
  }
  bool given() const { return given_; }
  int loops_silent() const { return loops_silent_; }

 private:
  int watchdog_loops_, loops_silent_ = 0, in_a_row_ = 0;
  bool safe_seen_ = false, given_ = false;
  Command last_;
};

class Watched {
 public:
  explicit Watched(const mcu::McuParams& params) : p_(params), core_(params), permission_(params.watchdog_loops) {}

  mcu::McuInput input{};

  void receive(std::uint8_t byte) {
    const std::int32_t x = core_.x_command(), v = core_.v_command(), f = core_.f_command();
    const bool driven = core_.driven();
    core_.receive(byte);
    if (!line_.push(byte)) {
      require(x == core_.x_command() && v == core_.v_command() && f == core_.f_command(), "no byte but a frame moves");
      return;
    }
    ++frames_;
    permission_.frame(mcu::unpack_command(line_.payload()), active(state_));
    if (!active(state_) || !driven) return;  // then it starts where the joint is
    require(std::abs(core_.x_command() - x) <= p_.x_step && std::abs(core_.v_command() - v) <= p_.v_step &&
                std::abs(core_.f_command() - f) <= p_.f_step,
            "a frame moves each reference by a step at most");
  }

  void loop() {
    // What silence let go is taken again from the torque of its spring.
    const bool taken = core_.driven() && !driven_ && active(state_);
    const std::int32_t before = taken ? core_.spring_torque() : core_.torque_command();
    driven_ = core_.driven();
    const std::int32_t x_before = core_.x_command();
    const std::uint8_t faults_before = core_.faults();
    const mcu::McuOutput output = core_.step(input);
    const std::int32_t torque = core_.torque_command();
    stopped_loops_ = input.stop ? stopped_loops_ + 1 : 0;
    released_loops_ = input.release && !input.stop ? released_loops_ + 1 : 0;

    require(std::abs(output.motor_velocity) <= p_.motor_speed_limit, "the motor's speed is limited");
    require(std::abs(torque) <= p_.torque_limit, "the torque is limited");
    const std::int32_t ramp = p_.torque_limit / std::min(p_.stop_loops, p_.ramp_loops) + p_.ramp_loops;
    require(std::abs(torque - before) <= std::max(p_.torque_step, ramp), "the torque does not jump");
    require(std::abs(core_.x_command() - x_before) <= p_.x_step, "no reference jumps between frames");
    require(torque == 0 || active(output.state) || output.state == State::kFault, "there is no torque in SAFE");
    require(!active(output.state) || active(state_) || permission_.given(), "only SAFE and three frames start it");
    if (permission_.loops_silent() > p_.watchdog_loops + p_.ramp_loops + 1) {
      require(torque == 0 && !active(output.state), "silence ends in SAFE within the ramp");
    }
    require(stopped_loops_ == 0 || output.state == State::kFault, "the patient's stop shows at once");
    require(stopped_loops_ < p_.stop_loops || torque == 0, "the patient's stop ends the torque within its ramp");
    const auto cleared = static_cast<std::uint8_t>(faults_before & ~core_.faults());
    require((cleared & ~(mcu::kWatchdog | mcu::kPatientStop)) == 0, "a fault stays until a reset");
    require((cleared & mcu::kPatientStop) == 0 || released_loops_ >= p_.release_loops, "only the key ends a stop");
    const std::uint8_t latched = core_.faults() & static_cast<std::uint8_t>(~mcu::kWatchdog);
    require((latched != 0) == (output.state == State::kFault), "a fault shows, and nothing else as one");
    fault_loops_ = latched != 0 ? fault_loops_ + 1 : 0;
    require(fault_loops_ <= p_.ramp_loops || torque == 0, "a fault ends the torque within the ramp");

    mcu::Telemetry frame;
    if (core_.telemetry(frame)) require(frame.state == output.state, "telemetry shows the state");
    permission_.loop(active(output.state), active(state_));
    state_ = output.state;
    driven_ = core_.driven();
  }

  std::uint64_t frames() const { return frames_; }

 private:
  mcu::McuParams p_;
  mcu::OrthosisMcu core_;
  mcu::FrameDecoder line_;
  Permission permission_;
  State state_ = State::kSafe;
  bool driven_ = false;
  std::uint64_t frames_ = 0;
  int stopped_loops_ = 0, released_loops_ = 0, fault_loops_ = 0;
};

}  // namespace

// A byte says what happens next: raw bytes, a frame, up to 64 loops, or other readings.
bool serial_mcu(Bytes bytes) {
  Cursor cursor(bytes);
  Watched mcu(params(cursor.byte()));
  for (int acts = 0; !cursor.empty() && acts < 2000; ++acts) {
    const std::uint8_t what = cursor.byte();
    switch (what >> 6) {
      case 0:
        for (const std::uint8_t byte : cursor.take(what & 63)) mcu.receive(byte);
        break;
      case 1: {
        std::array<std::uint8_t, mcu::kPayloadBytes> payload{};
        const Bytes given = cursor.take(payload.size());
        std::copy(given.begin(), given.end(), payload.begin());
        std::array<std::uint8_t, mcu::kWireBytes> wire;
        mcu::encode_frame(payload.data(), wire.data());
        for (const std::uint8_t byte : wire) mcu.receive(byte);
        break;
      }
      case 2:
        for (int loop = 0; loop <= (what & 63); ++loop) mcu.loop();
        break;
      default:
        mcu.input.stop = (what & 1) != 0;
        mcu.input.release = (what & 2) != 0;
        mcu.input.overrun = (what & 4) != 0;
        if ((what & 8) != 0) mcu.input.joint_counts = cursor.word();
        if ((what & 16) != 0) mcu.input.motor_counts = cursor.word();
        if ((what & 32) != 0) {
          mcu.input.sensor = static_cast<std::int16_t>(cursor.word());
          mcu.input.current = static_cast<std::uint16_t>(cursor.word());
        }
        mcu.loop();
    }
  }
  return mcu.frames() > 0;
}

}  // namespace farhand::fuzz
