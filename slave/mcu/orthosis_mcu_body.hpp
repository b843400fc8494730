// Definitions for orthosis_mcu.hpp. Two sources compile them: with parameters of a scene on the PC, with constants in
// the firmware.
#pragma once

#include "slave/mcu/orthosis_mcu.hpp"

namespace farhand {
namespace mcu {
constexpr uint8_t kFirmware = 7;
constexpr uint8_t kFramesToStart = 3;
constexpr uint8_t kLatched = kJointEncoder | kMotorEncoder | kSpringTorque | kOverrun | kPatientStop | kSpringSensor;

// Counts of the frame to units.
constexpr int32_t kXUnits = (int32_t(1) << kAngleBits) / kXRefCountsPerRad;
constexpr int32_t kVUnits = (int32_t(1) << kVelocityBits) / kVRefCountsPerRadPerS;
constexpr int32_t kFUnits = (int32_t(1) << kTorqueBits) / kFRefCountsPerNm;

constexpr uint8_t kSlowShift = 4;

inline int32_t magnitude(int32_t value) { return value < 0 ? -value : value; }
inline int32_t smaller(int32_t a, int32_t b) { return a < b ? a : b; }
inline int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }
inline int32_t limited(int32_t value, int32_t limit) { return clamp(value, -limit, limit); }
// From `now` towards `goal` by at most `step`.
inline int32_t towards(int32_t now, int32_t goal, int32_t step) { return now + limited(goal - now, step); }
inline int16_t to_int16(int32_t value) { return static_cast<int16_t>(clamp(value, -32767, 32767)); }

template <class P>
void OrthosisCore<P>::receive(uint8_t byte) {
  const bool complete = decoder_.push(byte);
  count_line_errors(static_cast<uint8_t>(decoder_.crc_errors() & 0xFF),
                    static_cast<uint8_t>(decoder_.framing_errors() & 0xFF));
  if (complete) take(unpack_command(decoder_.payload()));
}

template <class P>
void OrthosisCore<P>::take(const Command& command) {
  if (command.mode == Mode::kConfig) return;
  echo_ = static_cast<uint8_t>((static_cast<uint8_t>(command.mode) << 4) | command.seq);
  number_ = number_of(command, number_);
  if (phase_ == Phase::kSafe) {
    silent_loops_ = 0;
    if (command.mode == Mode::kSafe) {
      safe_seen_ = true;
      consistent_ = 0;
    } else if (safe_seen_) {
      count_towards(command, previous_);
      previous_ = command;
      if (consistent_ == kFramesToStart) start(command.mode);
    }
  } else if (phase_ == Phase::kActive || phase_ == Phase::kFading) {
    if (command.mode == Mode::kSafe) {
      let_go(Phase::kLettingGo, p().stop_loops);
    } else if (command.mode == mode_) {
      consistent_ = 0;
      if (command.seq == previous_.seq) return;
      if (phase_ == Phase::kFading) resume(command);
      previous_.seq = command.seq;
      accept(command);
    } else {
      count_towards(command, other_);
      other_ = command;
      if (consistent_ == kFramesToStart && phase_ == Phase::kFading) return resume(command);
      if (consistent_ == kFramesToStart) change(command);
    }
  }
}

template <class P>
void OrthosisCore<P>::count_towards(const Command& command, const Command& before) {
  consistent_ = static_cast<uint8_t>(consistent_ > 0 && follows(before, command) ? consistent_ + 1 : 1);
}

template <class P>
bool OrthosisCore<P>::follows(const Command& previous, const Command& next) const {
  const auto near = [](int16_t a, int16_t b, int32_t units, int32_t step) {
    return limited((int32_t(b) - a) * units, step) == (int32_t(b) - a) * units;
  };
  return next.mode == previous.mode && next.seq == ((previous.seq + 1) & 15) &&
         near(previous.x_ref, next.x_ref, kXUnits, p().x_step) &&
         near(previous.v_ref, next.v_ref, kVUnits, p().v_step) && near(previous.f_ref, next.f_ref, kFUnits, p().f_step);
}

// A start causes no jump: the references begin at the joint's angle, velocity and torque, so that a_ref = 0. The torque
// starts at zero, as in SAFE, and its limit grows over the ramp time.
template <class P>
void OrthosisCore<P>::start(Mode mode) {
  phase_ = Phase::kActive;
  faults_ = static_cast<uint8_t>(faults_ & kLatched);
  tau_command_ = tau_allowed_ = bump_ = 0;
  joins_ = false;
  begin(mode);
}

// A change of mode causes no jump: the difference between the torque of the new mode and the commanded one fades out
// over the ramp time. The next loop determines the difference, because it computes both torques anyway.
template <class P>
void OrthosisCore<P>::change(const Command& command) {
  begin(command.mode);
  previous_ = command;
  joins_ = true;
}

// Driving the hand again after silence causes no jump: the references begin at the joint's present motion and at the
// torque of its spring, and the limit of the torque grows from there.
template <class P>
void OrthosisCore<P>::resume(const Command& command) {
  phase_ = Phase::kActive;
  tau_command_ = limited(tau_spring_, tau_allowed_);
  tau_allowed_ = magnitude(tau_command_);
  change(command);
}

template <class P>
void OrthosisCore<P>::begin(Mode mode) {
  mode_ = mode;
  x_command_ = x_;
  v_command_ = v_;
  f_command_ = mode == Mode::kTrack ? -f_s_ : f_s_;
  consistent_ = 0;
  silent_loops_ = loops_since_frame_ = 0;
}

// A wrong frame passes the CRC once in 65536. The gate acts once per frame and not once per loop, so that such a frame
// moves each reference by one step, however long it stays the newest. References are first cut to the limits of the
// joint. A start outside the range moves into it by the same steps.
template <class P>
void OrthosisCore<P>::accept(const Command& command) {
  silent_loops_ = loops_since_frame_ = 0;
  x_command_ = towards(x_command_, clamp(command.x_ref * kXUnits, p().x_min, p().x_max), p().x_step);
  v_command_ = towards(v_command_, limited(command.v_ref * kVUnits, p().v_limit), p().v_step);
  f_command_ = towards(f_command_, limited(command.f_ref * kFUnits, p().torque_limit), p().f_step);
}

template <class P>
inline bool OrthosisCore<P>::read(const EncoderUnit& unit, int32_t counts, int32_t& angle) const {
  if (counts > unit.most_counts || counts < -unit.most_counts) return false;
  // 16 bits hold every count of a real encoder, and an 8-bit MCU computes with them four times as fast.
  const bool narrow = unit.most_counts <= 0x7FFF && unit.whole <= 0xFFFF;
  const int32_t now = narrow ? narrow_product(counts, static_cast<uint16_t>(unit.whole)) +
                                   ((narrow_product(counts, unit.fraction) + 0x8000) >> 16)
                             : counts * unit.whole + times(counts, Gain{unit.fraction, 16});
  if (started_ && limited(now - angle, unit.jump) != now - angle) return false;
  angle = now;
  return true;
}

template <class P>
void OrthosisCore<P>::sense(const McuInput& input) {
  // Angles, and the torque of the spring between them.
  if (!read(p().joint, input.joint_counts, x_)) faults_ |= kJointEncoder;
  if (!read(p().motor, input.motor_counts, x_motor_)) faults_ |= kMotorEncoder;
  tau_spring_ = times(x_motor_ - x_, p().spring);
  if (limited(tau_spring_, p().spring_fault) != tau_spring_) faults_ |= kSpringTorque;
  // The spring's own sensor must agree; a single loop may differ, because the two are not sampled at the same instant.
  if (p().sensor_apart > 0) {
    const int32_t apart = clamp(input.sensor, -kSensorCounts, kSensorCounts) * p().sensor_unit - tau_spring_;
    apart_in_a_row_ = static_cast<uint16_t>(limited(apart, p().sensor_apart) != apart ? apart_in_a_row_ + 1 : 0);
    if (apart_in_a_row_ >= p().sensor_loops) faults_ |= kSpringSensor, apart_in_a_row_ = p().sensor_loops;
  }
  // Values that are only reported, and overruns, which are a fault when they do not end.
  temperature_c_ = input.temperature_c;
  current_ = static_cast<uint8_t>(input.current > 1023 ? 255 : input.current >> 2);
  overruns_in_a_row_ = static_cast<uint16_t>(input.overrun ? overruns_in_a_row_ + 1 : 0);
  overruns_ = static_cast<uint8_t>(overruns_ + (input.overrun ? 1 : 0));
  if (overruns_in_a_row_ >= p().overrun_limit) faults_ |= kOverrun;
  if (!started_) {  // the filters start in the steady state of the present torque, at rest
    started_ = true;
    x_filtered_ = x_;
    dob_ = rtob_ = tau_slow_ = tau_spring_;
  }
}

template <class P>
void OrthosisCore<P>::estimate() {
  // v = (a / dt)(x - LPF[x]) is the telescoped band-limited derivative; both gains use the same difference. An encoder
  // that stood and recovers makes a step of the missed motion. No joint is as fast as this step, and the motor, which
  // follows v, would throw the hand ahead; therefore the difference is limited.
  const int32_t ahead = limited(x_ - x_filtered_, p().most_ahead);
  v_ = times(ahead, p().per_second);
  x_filtered_ = x_ - ahead + times(ahead, p().velocity_filter);
  const int32_t inertia = times(v_, p().inertia);
  dob_ += times(tau_spring_ + inertia - dob_, p().observer_filter);
  const int32_t tau_known = limited(tau_spring_ - times(v_, p().viscous), kLargest);
  rtob_ += times(tau_known + inertia - rtob_, p().observer_filter);
  tau_dis_ = limited(dob_ - inertia, kLargest);
  f_s_ = limited(rtob_ - inertia, kLargest);
}

// The commanded torque is zero after stop_loops; letting go ends after `loops`.
template <class P>
void OrthosisCore<P>::let_go(Phase phase, uint16_t loops) {
  if (phase_ == Phase::kActive) let_go_step_ = times(magnitude(tau_command_), p().per_stop_loop) + 1;
  phase_ = phase;
  loops_left_ = loops;
}

template <class P>
void OrthosisCore<P>::watch_stop(const McuInput& input) {
  if (input.stop) {
    faults_ |= kPatientStop;
    if (phase_ == Phase::kActive || phase_ == Phase::kFading) let_go(Phase::kLettingGo, p().stop_loops);
  }
  if ((faults_ & kPatientStop) == 0) return;
  // A release key that is stuck or pressed while the stop is pressed has no effect.
  if (input.stop || !input.release) release_seen_up_ = !input.release;
  release_loops_ = static_cast<uint16_t>(release_seen_up_ && input.release && !input.stop ? release_loops_ + 1 : 0);
  if (release_loops_ < p().release_loops || phase_ == Phase::kLettingGo) return;
  release_loops_ = 0;
  release_seen_up_ = false;
  faults_ = static_cast<uint8_t>(faults_ & ~kPatientStop);
  if ((faults_ & kLatched) == 0) phase_ = Phase::kSafe;
  safe_seen_ = false;
  consistent_ = 0;
}

template <class P>
void OrthosisCore<P>::supervise(const McuInput& input) {
  // The patient's stop has priority; then silence of the host, then latched faults.
  watch_stop(input);
  if (silent_loops_ <= p().watchdog_loops) ++silent_loops_;
  const bool silent = silent_loops_ > p().watchdog_loops;
  if (phase_ == Phase::kSafe && silent) safe_seen_ = false, consistent_ = 0;
  if (phase_ == Phase::kActive && silent) {
    let_go(Phase::kFading, p().ramp_loops);
    happened_ |= kSagged;
  }
  if ((faults_ & kLatched) != 0 && (phase_ == Phase::kActive || phase_ == Phase::kFading)) {
    let_go(Phase::kLettingGo, p().stop_loops);
  }
  if ((faults_ & kLatched) != 0 && phase_ == Phase::kSafe) phase_ = Phase::kFault;
}

template <class P>
int32_t OrthosisCore<P>::wanted_acceleration() const {
  if (mode_ == Mode::kTorque) {
    return times(f_command_ - f_s_, p().K_f) + times(v_command_ - v_, p().K_d);
  }
  return times(x_command_ - x_, p().K_p) + times(v_command_ - v_, p().K_d) - times(f_command_ + f_s_, p().K_f);
}

// Growth of the resisting torque, computed once per frame.
template <class P>
void OrthosisCore<P>::look_ahead() {
  const int32_t rise = tau_dis_ - tau_slow_;
  tau_slow_ += rise >> kSlowShift;
  const int32_t ahead = rise + (rise >> 2);
  resists_soon_ = ahead + 2 * rise;
  given_ahead_ =
      limited(ahead, larger(0, smaller(p().most_given_ahead, (p().torque_limit - magnitude(tau_dis_)) >> 1)));
}

template <class P>
int32_t OrthosisCore<P>::allowed_speed(int32_t resisting) const {
  const int32_t step = resisting >> kResistanceShift;
  return p().allowed_speed[step < 0 ? 0 : step < kResistanceSteps ? step : kResistanceSteps - 1];
}

// Far outside the range the two bounds contradict each other. Then the bound on speed has priority, so that the hand is
// not thrown on its way back.
template <class P>
int32_t OrthosisCore<P>::bounded(int32_t acceleration) const {
  const int32_t brake = times(v_, p().k_B), brake_at_end = 2 * brake;
  int32_t up = allowed_speed(larger(tau_spring_, tau_dis_) + larger(resists_soon_, 0));
  int32_t down = -allowed_speed(-(smaller(tau_spring_, tau_dis_) + smaller(resists_soon_, 0)));
  if (brake > 0) {
    up = smaller(up + clamp(given_ahead_, 0, 3 * brake), p().allowed_speed[0]) - brake;
    down = smaller(down, up);
  } else {
    down = larger(down + clamp(given_ahead_, 3 * brake, 0), -p().allowed_speed[0]) - brake;
    up = larger(up, down);
  }
  const int32_t up_to_end = times(p().x_max - x_, p().k_E) - brake_at_end;
  const int32_t down_to_end = times(p().x_min - x_, p().k_E) - brake_at_end;
  return clamp(acceleration, larger(down, down_to_end), smaller(up, up_to_end));
}

template <class P>
void OrthosisCore<P>::move_torque_command() {
  if (phase_ == Phase::kActive) {
    // Between two frames the reference moves on at its own velocity; if a frame is overdue it stays.
    if (mode_ == Mode::kTrack && loops_since_frame_ > 0 && loops_since_frame_ < p().loops_per_frame) {
      const int32_t next = x_command_ + times(v_command_, p().per_loop);
      x_command_ = towards(x_command_, clamp(next, p().x_min, p().x_max), p().x_step);
    }
    if (loops_since_frame_ < p().loops_per_frame) ++loops_since_frame_;
    // The law, with a difference that fades after a change of mode, so that the torque does not jump.
    tau_allowed_ = limited(tau_allowed_ + p().allowed_step, p().torque_limit);
    const int32_t free = wanted_acceleration();
    if (joins_) {
      joins_ = false;
      bump_ = tau_command_ - limited(free + tau_dis_, tau_allowed_);
      bump_step_ = times(magnitude(bump_), p().per_ramp_loop) + 1;
    }
    bump_ = towards(bump_, 0, bump_step_);
    // The bound at the hand, then the limits of size and rate.
    const int32_t asked = free + bump_, given = bounded(asked);
    if (given != asked) happened_ |= kBounded;
    const int32_t wanted = limited(given + tau_dis_, tau_allowed_);
    tau_command_ = towards(tau_command_, wanted, p().torque_step);
  } else if (phase_ == Phase::kFading || phase_ == Phase::kLettingGo) {
    tau_command_ = towards(tau_command_, 0, let_go_step_);
    if (--loops_left_ > 0) return;
    if (phase_ == Phase::kFading) faults_ |= kWatchdog;
    phase_ = (faults_ & kLatched) != 0 ? Phase::kFault : Phase::kSafe;
    tau_command_ = 0;
    safe_seen_ = false;
    consistent_ = 0;
  }
}

// One of the two measurements that disagree is wrong, and following it may wind the spring up without end. Therefore
// the motor only moves in a direction that reduces the torque by both measurements, and only as fast as the smaller one
// asks for.
template <class P>
void OrthosisCore<P>::give_way(const McuInput& input) {
  const int32_t sensed = clamp(input.sensor, -kSensorCounts, kSensorCounts) * p().sensor_unit;
  int32_t agreed = 0;
  if (sensed > 0 && tau_spring_ > 0) agreed = sensed < tau_spring_ ? sensed : tau_spring_;
  if (sensed < 0 && tau_spring_ < 0) agreed = sensed > tau_spring_ ? sensed : tau_spring_;
  motor_velocity_ = limited(-times(agreed, p().spring_gain), p().motor_speed_limit);
}

template <class P>
McuOutput OrthosisCore<P>::step(const McuInput& input) {
  sense(input);
  estimate();
  supervise(input);
  move_torque_command();
  // Done in a loop that sends no frame, if there is one, because that loop has time.
  if (loop_of_frame_ == 0) {
    look_ahead();
    prepare_page();
  }
  if (++loop_of_frame_ >= p().loops_per_frame) loop_of_frame_ = 0;
  motor_velocity_ = limited(v_ + times(tau_command_ - tau_spring_, p().spring_gain), p().motor_speed_limit);
  if ((faults_ & kSpringSensor) != 0) give_way(input);
  // Without an angle there is no spring torque to control: the motor stands, and the patient can move within the
  // spring.
  if ((faults_ & (kJointEncoder | kMotorEncoder)) != 0) motor_velocity_ = 0;
  State state = State::kSafe;
  if (phase_ != Phase::kSafe && phase_ != Phase::kFault) {
    state = mode_ == Mode::kTorque ? State::kTorque : State::kTrack;
  }
  if ((faults_ & kLatched) != 0) state = State::kFault;
  state_ = state;
  return {motor_velocity_, state};
}

template <class P>
bool OrthosisCore<P>::telemetry(uint8_t wire[kWireBytes]) {
  Telemetry frame;
  if (!telemetry(frame)) return false;
  encode(frame, wire);
  return true;
}

template <class P>
bool OrthosisCore<P>::telemetry(Telemetry& frame) {
  if (loop_of_frame_ != 0) return false;
  telemetry_seq_ = next_telemetry();
  frame.state = state_;
  frame.seq = telemetry_seq_;
  frame.angle = to_int16(times(x_, p().angle_telemetry));
  frame.torque = to_int16(times(f_s_, p().torque_telemetry));
  frame.slow = slow_byte(slow_page(telemetry_seq_));
  return true;
}

// Computes the page value of the next frame that needs a product.
template <class P>
void OrthosisCore<P>::prepare_page() {
  const SlowPage page = slow_page(next_telemetry());
  if (page == SlowPage::kSpringTorqueHigh) wide_ = to_int16(times(tau_spring_, p().torque_telemetry));
  if (page == SlowPage::kMotorAngleHigh) wide_ = to_int16(times(x_motor_, p().angle_telemetry));
}

template <class P>
uint8_t OrthosisCore<P>::slow_byte(SlowPage page) {
  switch (page) {
    case SlowPage::kSpringTorqueHigh:
    case SlowPage::kMotorAngleHigh:
      return static_cast<uint8_t>((wide_ >> 8) & 0xFF);
    case SlowPage::kSpringTorqueLow:
    case SlowPage::kMotorAngleLow:
      return static_cast<uint8_t>(wide_ & 0xFF);
    case SlowPage::kMotorSpeedCommand:
      return static_cast<uint8_t>(clamp((motor_velocity_ + 0x8000) >> 16, -127, 127) & 0xFF);
    case SlowPage::kTemperatureC:
      return static_cast<uint8_t>(temperature_c_);
    case SlowPage::kFaults:
      return faults_;
    case SlowPage::kCrcErrors:
      return crc_errors_;
    case SlowPage::kFramingErrors:
      return framing_errors_;
    case SlowPage::kOverruns:
      return overruns_;
    case SlowPage::kFirmware:
      return kFirmware;
    case SlowPage::kRestart:
      return restart_;
    case SlowPage::kCurrent:
      return current_;
    case SlowPage::kNumberHigh:
      return static_cast<uint8_t>((number_ >> 4) & 0xFF);
    case SlowPage::kNumberLow:
      return static_cast<uint8_t>(number_ & 0xFF);
    case SlowPage::kCommandEcho:
      break;
  }
  const uint8_t echo = static_cast<uint8_t>(echo_ | happened_);
  happened_ = 0;
  return echo;
}

}  // namespace mcu
}  // namespace farhand
