// The host's end of the serial line to the orthosis MCU: references out, telemetry in, and the host's own decision
// whether the device can be trusted now.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>

#include "common/device/line_age.hpp"
#include "common/device/mcu_si.hpp"
#include "common/device/serial_counters.hpp"
#include "common/device/truth.hpp"
#include "common/station/drive_io.hpp"

namespace farhand {

// Port: `std::size_t read(std::span<std::uint8_t>, double t_s) noexcept`, `bool write(std::span<const std::uint8_t>,
// double t_s) noexcept`, `void drop_unsent(double t_s) noexcept` (what waits to leave) and `bool lost() noexcept`.
template <class Port>
class McuAxis {
 public:
  using Io = ReferenceIo<1>;

  template <class... Args>
  explicit McuAxis(Args&&... port_args) : port(std::forward<Args>(port_args)...) {}

  Port port;

  // Called before the loop. tick_s: time from read to read, s. Throws std::invalid_argument.
  void ticks_every(double tick_s) {
    if (tick_s < LineAge::kShortestTick || tick_s > LineAge::kLongestTick)
      throw std::invalid_argument("tick_s: the serial line of an MCU needs a tick of 0.00087 to 0.005 s");
    line_ = LineAge(tick_s);
  }

  // The readings are valid while telemetry is fresh, the MCU is not in a fault, and its state is the commanded one. The
  // device counts as lost in three more cases. The MCU has let go by itself (its own watchdog) although the station is
  // engaged. This host has not read for longer than the serial timer, so that the frames that wait are of unknown age.
  // The line lags, which is decided after all waiting frames have been read.
  Io::Sensed read(double t_s) noexcept {
    std::array<std::uint8_t, 64> bytes;
    sensed_.periods = 0;
    line_.begin(t_s);
    for (int burst = 0; burst < kBursts; ++burst) {
      const std::size_t n = port.read(bytes, t_s);
      for (std::size_t i = 0; i < n; ++i) {
        if (decoder_.push(bytes[i])) take(mcu::unpack_telemetry(decoder_.payload()), t_s);
      }
      if (n < bytes.size()) break;
    }
    const bool measured = line_.end(t_s);
    counters_.crc_errors = decoder_.crc_errors();
    counters_.framing_errors = decoder_.framing_errors();
    const bool fresh = heard_ && t_s - heard_s_ <= kSilence;
    const bool awake = t_s - read_s_ <= kSilence;
    read_s_ = t_s;
    const bool obeys = asked_ == mcu::Mode::kSafe || state_ == state_of(asked_) || t_s - asked_since_s_ < kTakeOver;
    sensed_.line = line_.quality();
    tell_line();
    const bool lags = measured && sensed_.line == LineQuality::kLags;
    if (lags || !fresh || !awake) line_.forget();
    if (!fresh) sensed_.device.fault = DeviceFault::kNone;  // old faults may have been reset
    sensed_.valid = fresh && awake && !lags && !port.lost() && state_ != mcu::State::kFault && obeys;
    sensed_.at_rest = state_ == mcu::State::kSafe;
    return sensed_;
  }

  void write(const Io::Command& command, double t_s) noexcept {
    const mcu::Mode mode = mode_of(command);
    if (mode != asked_) asked_since_s_ = t_s;
    asked_ = mode;
    const Motion<1>& r = command.reference;
    const std::uint16_t number = line_.send(t_s);
    const auto seq = static_cast<std::uint8_t>(number & 15);
    const double f_ref = mode == mcu::Mode::kTorque ? -r.f[0] : r.f[0];  // a torque, or the peer's reaction
    mcu::Command frame = command.stop ? mcu::make_stop(seq) : mcu::make_command(mode, seq, r.x[0], r.v[0], f_ref);
    mcu::set_number(frame, number);
    // A zero byte first, because a frame that was cut off would otherwise swallow the next one.
    std::array<std::uint8_t, 1 + mcu::kWireBytes> wire{};
    mcu::encode(frame, wire.data() + 1);
    const bool overtakes = command.stop && !stopping_;
    stopping_ = command.stop;
    if (overtakes) port.drop_unsent(t_s);
    if (port.write(std::span(wire).subspan(overtakes ? 0 : 1), t_s)) {
      ++counters_.sent;
    } else {
      ++counters_.dropped;
    }
  }

  // Only a port to a simulated device knows the true values.
  Truth truth() const noexcept {
    if constexpr (requires { port.truth(); }) {
      return port.truth();
    } else {
      return kNoTruth;
    }
  }
  const SerialCounters& counters() const noexcept { return counters_; }
  const LineAge& line() const noexcept { return line_; }
  mcu::State state() const noexcept { return state_; }
  const mcu::SlowValues& slow() const noexcept { return slow_; }

 private:
  static constexpr double kSilence = 0.050;   // s, the serial timer
  static constexpr int kBursts = 1100;        // more than the kernel keeps of a line that nobody reads (64 + 4 KiB)
  static constexpr double kTakeOver = 0.100;  // s, for three frames there, one back and a late host

  void take(const mcu::Telemetry& telemetry, double t_s) noexcept {
    // A line that repeats its last frame has no MCU behind it.
    if (heard_ && telemetry.seq == telemetry_seq_) return;
    sensed_.periods += heard_ ? (telemetry.seq - telemetry_seq_) & 63 : 1;
    telemetry_seq_ = telemetry.seq;
    ++counters_.received;
    heard_ = true;
    heard_s_ = t_s;
    state_ = telemetry.state;
    sensed_.x[0] = mcu::angle_rad(telemetry);
    sensed_.f[0] = mcu::torque_nm(telemetry);
    slow_.take(telemetry);
    line_.take(telemetry, slow_.firmware() >= LineAge::kTells);
    const mcu::SlowPage page = mcu::slow_page(telemetry.seq);
    if (page == mcu::SlowPage::kCurrent) sensed_.device.motor_current = slow_.motor_current_a();
    if (page == mcu::SlowPage::kTemperatureC) sensed_.device.surface_temperature = slow_.temperature_c();
    if (page == mcu::SlowPage::kFaults) sensed_.device.fault = fault_of(slow_.faults());
    if (page == mcu::SlowPage::kCommandEcho) {
      sensed_.device.bounded = (slow_.happened() & mcu::kBounded) != 0;
      counters_.sagged += (slow_.happened() & mcu::kSagged) != 0 ? 1 : 0;
    }
  }

  void tell_line() noexcept {
    counters_.age_s = line_.age_s();
    if (std::isfinite(line_.need_s())) counters_.need_s = line_.need_s();
    counters_.most_age_s = line_.most_s();
    counters_.warned = line_.warned();
    counters_.warns = line_.warns();
    counters_.blind = line_.blind();
  }

  static mcu::Mode mode_of(const Io::Command& command) noexcept {
    if (!command.track) return mcu::Mode::kSafe;
    return command.gives_torque ? mcu::Mode::kTorque : mcu::Mode::kTrack;
  }
  static mcu::State state_of(mcu::Mode active) noexcept {
    return active == mcu::Mode::kTorque ? mcu::State::kTorque : mcu::State::kTrack;
  }

  // The faults of its sensors; the other faults show in its state.
  static DeviceFault fault_of(std::uint8_t faults) noexcept {
    if ((faults & mcu::kSpringSensor) != 0) return DeviceFault::kSpring;
    return (faults & (mcu::kJointEncoder | mcu::kMotorEncoder)) != 0 ? DeviceFault::kEncoder : DeviceFault::kNone;
  }

  mcu::FrameDecoder decoder_;
  SerialCounters counters_;
  LineAge line_;
  Io::Sensed sensed_;
  mcu::State state_ = mcu::State::kSafe;
  mcu::SlowValues slow_;
  std::uint8_t telemetry_seq_ = 0;
  double heard_s_ = 0.0, read_s_ = 0.0, asked_since_s_ = 0.0;
  mcu::Mode asked_ = mcu::Mode::kSafe;
  bool heard_ = false, stopping_ = false;
};

}  // namespace farhand
