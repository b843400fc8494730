// The orthosis MCU: closes position, force and spring-torque loops of the series-elastic hand orthosis at 2 kHz. The PC
// sends references at 1 kHz; no loop is closed across the serial line. Freestanding C++14, scaled integers, no heap:
// firmware and PC compile the same source and compute the same bits.
//
//   tau_spring = k (x_motor - x)                                     the torque sensor
//   tau_dis = LPF_g[tau_spring + J_n g v] - J_n g v                  (Daud 2011, B.8; the spring is the applied torque)
//   f_s     = LPF_g[tau_spring - D v + J_n g v] - J_n g v            (B.10)
//   TRACK:  a_ref = K_p (x_ref - x) + K_d (v_ref - v) - K_f (f_ref + f_s)     (5.11)
//   TORQUE: a_ref = K_f (f_ref - f_s) + K_d (v_ref - v)
//   tau_ref = J_n bound(a_ref) + tau_dis, limited; 0 in SAFE         J a = tau - f
//   v_motor = v + gain (tau_ref - tau_spring), limited
//
// TORQUE brings the reaction to f_ref; the joint then behaves as an inertia of 1/K_f without friction. K_d damps only
// the difference between v and v_ref. If the host sends the velocity that it read, only the change since then is
// damped; if it sends less, the difference is damped here, without the delay of the line.
//
// The bound at the hand is the same in both modes, whatever frames come. Towards x_max, and in the same way to x_min,
//
//   a_ref <= k_B (v_allow(torque + 3.25 rise) - max(v, 0)) + 1.25 rise / J_n, and <= k_B (v_max - max(v, 0))
//   v_allow(torque) = min(v_max, P / (torque + 0.1 N m), 1.25 v_max (1.07 - torque / limit))
//   a_ref <= 2 k_B (18/s (x_max - x) - v)                                                   k_B = 30..36/s
//   rise = tau_dis - LPF[tau_dis], if it is positive: the growth of tau_dis in 16 ms
//
// where torque is the torque that resists that direction: the larger of the spring's, known without lag, and tau_dis.
// The allowed acceleration thus follows from present torque, speed and angle, and not from power that was given
// already. The motor is slow: if more were allowed while the hand comes back (v < 0), the motor's torque would arrive
// after the hand has turned, and a hand of 20 N m/rad would oscillate from k_B = 25/s on. Near the torque limit the
// allowed speed is low enough that a hand can be stopped within the limit. With 18/s towards an end of the range the
// hand can still be stopped there.
//
// The two terms of rise bound the power of a motion whose torque grows, d/dt (v_allow - v) >= -k_B (v_allow - v). The
// first predicts the torque: a torque that will be larger allows less speed. The second compensates the delay of 20 ms
// with which a commanded torque acts on the hand (tau_dis is 10 ms old, and the spring follows 10 ms later). Without
// the first term a stiff hand oscillates; without the second nobody can be led at 1 W into 15 N m/rad. The second term
// is limited to 0.4 N m (0.2 for a motor of 8 rad/s), to half of the remaining torque up to the limit, and to J_n 3 k_B
// v (0.4 N m at 1 rad/s): the torque of a hand that has stopped grows no more, and torque that is added after that
// would throw the lightest and stiffest hand.
//
// Letting go is the same whatever its cause and whatever ends it: the commanded torque goes to zero in 2 ms, and the
// spring unwinds as fast as the motor turns. The motor's speed makes this gentle: 40 N m/s at 4 rad/s and 10 N m/rad. A
// slower ramp would hold the hand meanwhile, and some hands would then swing further than after the patient's stop.
//
// SAFE is the first state. It drives the spring torque to zero: the patient moves freely. After 20 ms without a valid
// frame the MCU lets go, and 50 ms later the state is SAFE. Until then the next frame of the same mode drives the hand
// again, from the torque that the spring then has. SAFE ends only with a SAFE frame and then three consecutive,
// consistent frames of one active mode. Three such frames of the other active mode change the mode; the commanded
// torque continues without a step.
//
// In an active state only a frame with a new sequence number resets the watchdog: a line that repeats its last frame
// has no host behind it.
//
// The patient's stop lets go from every state and is latched. No byte on the line ends it; only the release key beside
// the stop does, if it is pressed anew and held after the stop is up.
#pragma once

#include "common/device/mcu_frame.hpp"
#include "slave/mcu/fixed_point.hpp"

namespace farhand {
namespace mcu {

// The table of v_allow over the resisting torque, in steps of 2^-5 N m.
constexpr uint8_t kResistanceShift = kTorqueBits - 5;
constexpr uint8_t kResistanceSteps = 128;

// Made from SI by make_mcu_params (slave/mcu/mcu_params.hpp), which checks that everything fits.
struct EncoderUnit {
  int32_t whole;        // angle units per count, integer part
  uint16_t fraction;    // and 2^-16 parts
  int32_t most_counts;  // beyond +-4 rad the reading is implausible
  int32_t jump;         // largest plausible change in one loop, angle units
};

struct McuParams {
  EncoderUnit joint, motor;
  Gain spring;                       // k
  Gain velocity_filter, per_second;  // a = g_v dt / (1 + g_v dt), a / dt
  int32_t most_ahead;                // of x before LPF[x]
  Gain observer_filter, inertia;     // g dt / (1 + g dt), J_n g
  Gain viscous;                      // D
  Gain K_p, K_d, K_f;                // times J_n
  Gain spring_gain;
  Gain per_loop;  // angle moved in one loop per velocity
  Gain angle_telemetry, torque_telemetry;
  int32_t torque_limit, torque_step;  // step: per loop
  int32_t spring_fault;               // spring torque beyond this is a fault
  int32_t sensor_unit;                // torque per count of the spring's own sensor
  int32_t sensor_apart;               // it may differ by this from k (x_motor - x) for sensor_loops; 0: no sensor
  int32_t motor_speed_limit;
  int32_t x_step, v_step, f_step;  // how far one frame may move a reference
  int32_t x_min, x_max;
  int32_t v_limit;                          // of the joint, and of v_ref
  Gain k_B, k_E;                            // times J_n
  int32_t allowed_speed[kResistanceSteps];  // J_n k_B v_allow
  int32_t most_given_ahead;                 // torque
  Gain per_ramp_loop, per_stop_loop;        // 1 / ramp_loops, 1 / stop_loops: no division on an 8-bit MCU
  int32_t allowed_step;                     // per loop, of the allowed torque after a start
  uint16_t watchdog_loops, ramp_loops, loops_per_frame, overrun_limit;
  uint16_t stop_loops, release_loops, sensor_loops;
};

constexpr int16_t kSensorCounts = 512;   // of 10 bits: the spring's sensor spans -512 to 511
constexpr int16_t kCurrentCounts = 256;  // per ampere, of 10 bits: up to 4 A

struct McuInput {
  int32_t joint_counts;
  int32_t motor_counts;  // seen at the joint
  int8_t temperature_c;
  bool overrun;          // the loop before this one did not end in time
  bool stop = false;     // the patient's stop is pressed, or its wire is broken
  bool release = false;  // the key beside it that ends a stop
  int16_t sensor = 0;    // the spring's own torque sensor, counts
  uint16_t current = 0;  // of the motor, counts
};

struct McuOutput {
  int32_t motor_velocity;  // 2^-20 rad/s
  State state;
};

// The restart page: why the MCU started last, in the bits of the ATmega's MCUSR, and how often it has restarted since
// its power came on, modulo 16, above them.
enum Restart : uint8_t {
  kPowerOn = 1,
  kExternalReset = 2,
  kBrownOut = 4,
  kWatchdogReset = 8,
};

// Parameters: StoredParams, or a class with the same members as compile-time constants, with which a product with a
// gain takes an 8-bit MCU a third of the time.
struct StoredParams {
  McuParams value;
  const McuParams& get() const { return value; }
};

template <class Parameters>
class OrthosisCore {
 public:
  // restart: content of the restart page.
  explicit OrthosisCore(const Parameters& parameters, uint8_t restart = kPowerOn)
      : parameters_(parameters), restart_(restart) {}

  // One byte from the serial line.
  void receive(uint8_t byte);
  // The same for firmware that decodes the line outside its loop: a valid frame, and the number of invalid ones.
  void take(const Command& command);
  void count_line_errors(uint8_t crc, uint8_t framing) { crc_errors_ = crc, framing_errors_ = framing; }

  // Computes one loop.
  McuOutput step(const McuInput& input);
  // Once after step: true when this loop sends a frame (1 kHz).
  bool telemetry(Telemetry& frame);
  bool telemetry(uint8_t wire[kWireBytes]);

  // In units of fixed_point.hpp, for tests.
  int32_t angle() const { return x_; }
  int32_t velocity() const { return v_; }
  int32_t spring_torque() const { return tau_spring_; }
  int32_t disturbance_torque() const { return tau_dis_; }
  int32_t reaction_torque() const { return f_s_; }
  int32_t torque_command() const { return tau_command_; }
  int32_t x_command() const { return x_command_; }
  int32_t v_command() const { return v_command_; }
  int32_t f_command() const { return f_command_; }
  uint8_t faults() const { return faults_; }
  bool driven() const { return phase_ == Phase::kActive; }  // in TRACK or TORQUE and not letting go
  bool at_bound() const {
    const int32_t acceleration = wanted_acceleration() + bump_;
    return driven() && bounded(acceleration) != acceleration;
  }
  const FrameDecoder& decoder() const { return decoder_; }

 private:
  enum class Phase : uint8_t { kSafe, kActive, kFading, kLettingGo, kFault };

  const McuParams& p() const { return parameters_.get(); }
  bool follows(const Command& previous, const Command& next) const;
  void count_towards(const Command& command, const Command& before);
  void start(Mode mode);
  void change(const Command& command);
  void resume(const Command& command);
  void begin(Mode mode);
  void accept(const Command& command);
  FARHAND_WITH_ITS_GAIN bool read(const EncoderUnit& unit, int32_t counts, int32_t& angle) const;
  void sense(const McuInput& input);
  void estimate();
  void supervise(const McuInput& input);
  void watch_stop(const McuInput& input);
  void let_go(Phase phase, uint16_t loops);
  int32_t wanted_acceleration() const;
  void look_ahead();
  int32_t bounded(int32_t acceleration) const;
  int32_t allowed_speed(int32_t resisting) const;
  void move_torque_command();
  void give_way(const McuInput& input);
  uint8_t next_telemetry() const { return static_cast<uint8_t>((telemetry_seq_ + 1) & 63); }
  void prepare_page();
  uint8_t slow_byte(SlowPage page);

  Parameters parameters_;
  FrameDecoder decoder_;
  uint8_t crc_errors_ = 0, framing_errors_ = 0;

  // Measured and estimated.
  bool started_ = false;
  int32_t x_ = 0, x_motor_ = 0, x_filtered_ = 0, v_ = 0;
  int32_t tau_spring_ = 0, dob_ = 0, rtob_ = 0, tau_dis_ = 0, f_s_ = 0;
  int32_t tau_slow_ = 0, given_ahead_ = 0, resists_soon_ = 0;
  int8_t temperature_c_ = 0;
  uint8_t current_ = 0;
  uint16_t overruns_in_a_row_ = 0, apart_in_a_row_ = 0;
  uint8_t overruns_ = 0;

  // From the PC, behind the rate gate.
  int32_t x_command_ = 0, v_command_ = 0, f_command_ = 0;
  uint16_t loops_since_frame_ = 0;

  Phase phase_ = Phase::kSafe;
  Mode mode_ = Mode::kSafe;  // while active or letting go
  State state_ = State::kSafe;
  uint8_t faults_ = 0;
  uint16_t silent_loops_ = 0;
  uint16_t release_loops_ = 0;
  bool release_seen_up_ = false;
  Command previous_, other_;  // newest frame; newest of the other active mode
  bool safe_seen_ = false;
  uint8_t consistent_ = 0;

  int32_t tau_command_ = 0, tau_allowed_ = 0, let_go_step_ = 0;
  int32_t bump_ = 0, bump_step_ = 0;  // between two active modes, fading
  bool joins_ = false;                // the next loop goes on from tau_command_
  uint16_t loops_left_ = 0;           // of letting go
  int32_t motor_velocity_ = 0;

  uint16_t loop_of_frame_ = 0, number_ = 0;
  uint8_t telemetry_seq_ = 63, echo_ = 0, happened_ = 0, restart_;
  int16_t wide_ = 0;  // of a page and the one after it
};

// The core with the parameters of a scene.
class OrthosisMcu : public OrthosisCore<StoredParams> {
 public:
  explicit OrthosisMcu(const McuParams& params, uint8_t restart = kPowerOn) : OrthosisCore({params}, restart) {}
};
extern template class OrthosisCore<StoredParams>;

}  // namespace mcu
}  // namespace farhand
