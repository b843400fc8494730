// A host of the MCU that has the right frames and means harm, a hand in the orthosis, and what that hand gets: its true
// torque, speed, power, angle and energy, of the simulated world. The host knows all of it, which is more than a real
// one would.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/emulator.hpp"
#include "tests/support/uniform.hpp"

namespace farhand::mcu {

struct Grasp {
  double stiffness = 2, spastic = 0, damping = 0.02;  // N m/rad, N m s/rad
  double inertia = 1;                                 // of what the MCU believes
  double motor_speed = 4;                             // rad/s
  double counts = 20000;                              // of both encoders
};

inline OrthosisEmulator::Params orthosis_of(const Grasp& grasp) {
  OrthosisEmulator::Params p;
  p.world.actuator.J *= grasp.inertia;
  p.world.actuator.motor_speed_limit = p.mcu.motor_speed_limit = grasp.motor_speed;
  p.world.actuator.joint_counts_per_rev = p.world.actuator.motor_counts_per_rev = grasp.counts;
  p.mcu.joint_counts_per_rev = p.mcu.motor_counts_per_rev = grasp.counts;
  p.mcu.spring_sensor_nm = 8;
  Hand::Params hand{grasp.stiffness, grasp.damping, 0, 0, 1e9};
  hand.spastic = grasp.spastic;
  p.world.environment.hand = hand;
  return p;
}

// How a reference is made up: a constant, with the motion, by a square wave, from what is at the hand.
struct Reference {
  double constant = 0, along = 0, wave = 0, share_of_truth = 0;
};
enum class Ask : std::uint8_t { kSafe, kStop, kTrack, kTorque, kSilence, kFlap };
struct Piece {
  Ask ask = Ask::kTrack;
  double duration_s = 0.1, wave_hz = 5, random = 0;
  Reference x, v, f;
  int frozen = 0;  // for 5 ms from its start: 1 the joint's encoder, 2 the motor's
};
struct Stream {
  std::array<Piece, 4> pieces;
};

class StreamMaker {
 public:
  explicit StreamMaker(std::uint64_t seed) : bits_(seed) {}

  Stream anew() {
    Stream s;
    for (Piece& piece : s.pieces) piece = make_piece();
    return s;
  }
  // A little different: some numbers, now and then a whole piece.
  Stream changed(Stream s, double by) {
    Piece& piece = s.pieces[bits_() % s.pieces.size()];
    if (once_in(6)) {
      piece = make_piece();
    } else {
      const auto change = [&](double& value, double most) {
        if (once_in(2)) value = std::clamp(value + by * most * uniform(bits_, -1, 1), -most, most);
        if (once_in(30)) value = -value;
      };
      for (Reference* r : {&piece.x, &piece.v, &piece.f}) {
        const double most = r == &piece.x ? 1 : r == &piece.v ? 8 : 4;
        change(r->constant, most), change(r->along, most), change(r->wave, most), change(r->share_of_truth, 1.5);
      }
      piece.duration_s = std::clamp(piece.duration_s * std::exp(by * uniform(bits_, -2, 2)), 1e-3, 0.4);
      piece.wave_hz = std::clamp(piece.wave_hz * std::exp(by * uniform(bits_, -1, 1)), 0.5, 200.0);
      if (once_in(8)) piece.ask = ask();
      if (once_in(8)) piece.frozen = static_cast<int>(bits_() % 3);
      if (once_in(8)) piece.random = uniform(bits_, 0, 1);
    }
    if (once_in(10)) std::swap(s.pieces[0], s.pieces[bits_() % s.pieces.size()]);
    return s;
  }

 private:
  bool once_in(std::uint64_t n) { return bits_() % n == 0; }
  Ask ask() {
    constexpr std::array kAsks{Ask::kTrack,  Ask::kTrack, Ask::kTrack, Ask::kTorque,  Ask::kTorque,
                               Ask::kTorque, Ask::kFlap,  Ask::kSafe,  Ask::kSilence, Ask::kStop};
    return kAsks[bits_() % kAsks.size()];
  }
  Reference make_reference(double most) {
    Reference r;
    const auto value = [&] { return once_in(3) ? (once_in(2) ? most : -most) : uniform(bits_, -most, most); };
    if (once_in(2)) r.constant = value();
    if (once_in(3)) r.along = value();
    if (once_in(3)) r.wave = value();
    if (once_in(2)) r.share_of_truth = uniform(bits_, -1.5, 1.5);
    return r;
  }
  Piece make_piece() {
    Piece piece;
    piece.ask = ask();
    piece.duration_s = log_uniform(bits_, 2e-3, 0.4);
    piece.wave_hz = log_uniform(bits_, 0.5, 200);
    if (once_in(4)) piece.random = uniform(bits_, 0, 1);
    piece.x = make_reference(1), piece.v = make_reference(8), piece.f = make_reference(4);
    if (once_in(6)) piece.frozen = 1 + static_cast<int>(bits_() % 2);
    return piece;
  }

  std::mt19937_64 bits_;
};

// What becomes of the hand once the MCU lets go of it, up to the next time.
struct LetGo {
  int ms = 0;
  double speed = 0, power = 0;              // until the MCU takes it again
  double speed_taken = 0, power_taken = 0;  // from then on, until it has come to rest
};

// The most of each while the MCU drives the hand.
struct Felt {
  double speed = 0, angle = 0, power = 0, mean_power = 0;  // the mean: over 50 ms
  double energy = 0;                                       // in any window, beyond 1.1 times the power limit
  double spring = 0, command = 0;
  double torque = 0;  // at the hand, less v sqrt(J K)
  double driven_s = 0;

  void add(const Felt& other) {
    constexpr std::array kAll{&Felt::speed,  &Felt::angle,  &Felt::power,   &Felt::mean_power,
                              &Felt::energy, &Felt::spring, &Felt::command, &Felt::torque};
    for (double Felt::*most : kAll) this->*most = std::max(this->*most, other.*most);
    driven_s += other.driven_s;
  }
};

// What a stream makes the person feel.
class RogueRun {
 public:
  RogueRun(const Grasp& grasp, const OrthosisEmulator::Params& params)
      : params_(params),
        orthosis_(params_),
        power_w_(McuSettings{}.power_limit),
        impedance_(std::sqrt(params_.world.actuator.J * grasp.stiffness)) {}

  // Every millisecond a frame; SAFE for the first ten, so that it can start. Pieces come again and again. From
  // stop_at_ms on there is an honest stop and nothing else; what breaks breaks all the same.
  Felt run(const Stream& stream, double duration_s, std::uint64_t seed, int stop_at_ms = 1 << 30) {
    std::mt19937_64 bits(seed);
    std::size_t now = 0;
    double left = stream.pieces[0].duration_s;
    for (int ms = 0; ms * 1e-3 < duration_s; ++ms) {
      const Piece& piece = stream.pieces[now];
      now_ms_ = ms;
      if (ms < 10) {
        send(make_command(Mode::kSafe, seq_++, 0, 0, 0));
      } else {
        if (ms >= stop_at_ms) {
          send(make_stop(seq_++));
        } else {
          tell(piece, ms, bits);
        }
        left -= 1e-3;
        if (left <= 0) {
          now = (now + 1) % stream.pieces.size();
          left = stream.pieces[now].duration_s;
          if (ms - froze_at_ms_ > 100 && stream.pieces[now].frozen != 0) frozen_ms_ = 5, froze_at_ms_ = ms;
        }
      }
      const int frozen = ms >= 10 && frozen_ms_ > 0 ? stream.pieces[now].frozen : 0;
      frozen_ms_ -= frozen_ms_ > 0 ? 1 : 0;
      orthosis_.joint_encoder().frozen = frozen == 1;
      orthosis_.motor_encoder().frozen = frozen == 2;
      loop();
      loop();
    }
    return felt_;
  }
  const std::vector<LetGo>& let_gos() const { return let_gos_; }

 private:
  void send(const Command& command) {
    std::uint8_t wire[kWireBytes];
    encode(command, wire);
    for (const std::uint8_t byte : wire) orthosis_.receive(byte);
  }
  void tell(const Piece& piece, int ms, std::mt19937_64& bits) {
    if (piece.ask == Ask::kSilence) return;
    if (piece.ask == Ask::kSafe) return send(make_command(Mode::kSafe, seq_++, 0, 0, 0));
    if (piece.ask == Ask::kStop) return send(make_stop(seq_++));
    const double wave = std::sin(2 * M_PI * piece.wave_hz * ms * 1e-3) >= 0 ? 1 : -1;
    const double along = truth_.v >= 0 ? 1 : -1;
    const auto value = [&](const Reference& r, double truth) {
      return r.constant + r.along * along + r.wave * wave + r.share_of_truth * truth;
    };
    double x = value(piece.x, truth_.x), v = value(piece.v, truth_.v), f = value(piece.f, truth_.f);
    if (piece.random > 0 && uniform(bits, 0, 1) < piece.random) {
      x = uniform(bits, -1, 1), v = uniform(bits, -8, 8), f = uniform(bits, -4, 4);
    }
    Mode mode = piece.ask == Ask::kTorque ? Mode::kTorque : Mode::kTrack;
    if (piece.ask == Ask::kFlap) mode = (ms / 3) % 2 == 0 ? Mode::kTrack : Mode::kTorque;
    send(make_command(mode, seq_++, x, v, f));
  }
  void loop() {
    std::uint8_t wire[kWireBytes];
    orthosis_.tick(wire);
    truth_ = orthosis_.world().truth();
    const double power = truth_.f * truth_.v, dt = 1 / params_.mcu.loop_hz;
    const bool driven = orthosis_.core().driven();
    if (!driven) {
      if (driven_) let_gos_.push_back({now_ms_});
      since_start_s_ = 0, calm_ = false;
    } else {
      const bool at_rest = since_start_s_ == 0 && std::abs(truth_.v) < 0.1 && std::abs(truth_.f) < 0.05;
      since_start_s_ += dt;
      calm_ = calm_ || at_rest || (since_start_s_ > params_.mcu.ramp_s && calms());
    }
    driven_ = driven;
    if (!let_gos_.empty() && !calm_) {
      LetGo& last = let_gos_.back();
      double& speed = driven ? last.speed_taken : last.speed;
      double& most_power = driven ? last.power_taken : last.power;
      speed = std::max(speed, std::abs(truth_.v)), most_power = std::max(most_power, power);
    }
    if (!calm_) {
      given_ = 0, loops_ = 0, sum_ = 0, recent_ = {};
      return;
    }
    felt_.driven_s += dt;
    felt_.speed = std::max(felt_.speed, std::abs(truth_.v));
    felt_.angle = std::max(felt_.angle, std::abs(truth_.x));
    felt_.power = std::max(felt_.power, power);
    felt_.spring = std::max(felt_.spring, std::abs(truth_.spring_torque));
    felt_.command = std::max(felt_.command, std::abs(to_nm(orthosis_.core().torque_command())));
    felt_.torque = std::max(felt_.torque, std::abs(truth_.f) - std::abs(truth_.v) * impedance_);
    double& oldest = recent_[loops_++ % recent_.size()];
    sum_ += power - oldest;
    oldest = power;
    if (loops_ >= recent_.size()) felt_.mean_power = std::max(felt_.mean_power, sum_ / kRecent);
    given_ = std::max(0.0, given_ + (power - 1.1 * power_w_) * dt);
    felt_.energy = std::max(felt_.energy, given_);
  }

  // A hand that was let go and is taken again while it still moves counts as let go until it is slow and stays inside.
  bool calms() const {
    const McuSettings& s = params_.mcu;
    const auto inside = [&](double x) { return x < s.range_max && x > s.range_min; };
    return std::abs(truth_.v) < 0.5 * s.velocity_limit && inside(truth_.x) && inside(truth_.x + 0.15 * truth_.v);
  }

  OrthosisEmulator::Params params_;
  OrthosisEmulator orthosis_;
  double power_w_, impedance_;
  SeriesElasticTruth truth_{};
  std::uint8_t seq_ = 0;
  int frozen_ms_ = 0, froze_at_ms_ = -100, now_ms_ = 0;
  bool driven_ = false;
  std::vector<LetGo> let_gos_;
  Felt felt_;
  double given_ = 0, sum_ = 0, since_start_s_ = 0;
  bool calm_ = false;
  std::size_t loops_ = 0;
  static constexpr int kRecent = 100;  // loops of 50 ms
  std::array<double, kRecent> recent_{};
};

}  // namespace farhand::mcu
