#include "netem/lab/rogue_judge.hpp"

#include <algorithm>
#include <cmath>

#include "netem/lab/unexplained_step.hpp"

namespace farhand::rogue {
namespace {

constexpr double kDegree = 0.0174533;

}  // namespace

const char* name_of(Line line) noexcept {
  switch (line) {
    case Line::kTorqueCommanded:
      return "torque commanded";
    case Line::kTorqueOfSpring:
      return "torque of the spring";
    case Line::kTorqueAtPerson:
      return "torque at the person";
    case Line::kSpeed:
      return "speed driven";
    case Line::kAngle:
      return "angle driven";
    case Line::kEnergy:
      return "energy beyond P t";
    case Line::kMeanPower:
      return "power over 50 ms";
    case Line::kPower:
      return "power driven";
    case Line::kSpeedLetGo:
      return "speed let go";
    case Line::kPowerLetGo:
      return "power let go";
    case Line::kJump:
      return "jump";
    case Line::kPressed:
      return "torque held pressed";
    case Line::kAnySpeed:
      return "speed in any state";
    case Line::kAnyPower:
      return "power in any state";
    case Line::kAnyAngle:
      return "angle in any state";
    case Line::kAnyTorque:
      return "torque in any state";
    case Line::kCount:
      break;
  }
  return "?";
}

const char* unit_of(Line line) noexcept {
  switch (line) {
    case Line::kSpeed:
    case Line::kSpeedLetGo:
    case Line::kAnySpeed:
      return "rad/s";
    case Line::kAngle:
    case Line::kJump:
    case Line::kAnyAngle:
      return "rad";
    case Line::kEnergy:
      return "J";
    case Line::kMeanPower:
    case Line::kPower:
    case Line::kPowerLetGo:
    case Line::kAnyPower:
      return "W";
    default:
      return "N m";
  }
}

Judge::Judge(const Allowed& allowed)
    : allowed_(allowed), store_(0.5 * allowed.body.J * allowed.speed * allowed.speed) {}

void Judge::meet(Line line, double value, double bound) {
  Worst& worst = findings_[static_cast<std::size_t>(line)];
  const double ratio = std::isfinite(value) ? value / bound : 1e9;
  if (ratio <= worst.ratio) return;
  worst = {value, bound, before_.t_s, ratio};
}

void Judge::see(const AtPerson& now) {
  const double dt = first_ ? 0.0 : now.t_s - before_.t_s;
  const double power = now.torque * now.body.v;
  const double mean_power = 0.5 * (power + before_.torque * before_.body.v);
  const bool gives = now.driven || now.commanded != 0, gave = before_.driven || before_.commanded != 0;
  before_ = now;
  if (first_) {
    first_ = false;
    return;
  }
  const double speed = std::fabs(now.body.v), torque = std::fabs(now.torque);
  meet(Line::kAnySpeed, speed, 1);
  meet(Line::kAnyPower, power, 1);
  meet(Line::kAnyAngle, std::fabs(now.body.x), 1);
  meet(Line::kAnyTorque, torque, 1);

  energy_ += gives && gave ? mean_power * dt : 0.0;
  see_windows(energy_);
  const Body& body = allowed_.body;
  if (gives) {
    // A mass that goes into a spring with v overshoots by v sqrt(J K); v is forgotten over a period of the two.
    const double period = body.K > 0 ? 6.28 * std::sqrt(body.J / body.K) : 0.0;
    went_in_ = std::max(speed, went_in_ * std::exp(-dt / std::max(period, dt)));
    const double more = allowed_.therapist ? 0.0 : went_in_ * std::sqrt(body.J * body.K);
    meet(Line::kTorqueCommanded, std::fabs(now.commanded), allowed_.torque + 0.05);
    meet(Line::kTorqueOfSpring, std::fabs(now.spring), allowed_.torque + 0.05);
    meet(Line::kTorqueAtPerson, torque, allowed_.torque + (allowed_.therapist ? 0.1 : 0.05) + more);
  }
  if (!now.driven) {
    see_let_go(now, power);
    return;
  }
  reference_known_ = false;
  let_go_from_ = torque_off_from_ = now.body;
  meet(Line::kSpeed, speed, 1.1 * allowed_.speed);
  meet(Line::kAngle, std::fabs(now.body.x), allowed_.range + (body.spastic >= 0.5 ? 4 : 1) * kDegree);
  if (body.spastic == 0) meet(Line::kPower, power, (body.K <= 5 ? 1.1 : 1.5) * allowed_.power);
}

// Every window at once: the excess of energy over 1.1 P t now, less the least that it had been 5 ms ago or before.
void Judge::see_windows(double energy_j) {
  const double t = before_.t_s;
  const Account now{t, energy_j, energy_j - 1.1 * allowed_.power * t};
  accounts_[count_ % kRing] = now;
  if (count_ == 0) least_excess_ = now.excess;
  const auto at = [&](std::size_t k) -> const Account& { return accounts_[k % kRing]; };
  for (; for_shortest_ <= count_ && at(for_shortest_).t_s <= t - kShortest + 1e-9; ++for_shortest_)
    least_excess_ = std::min(least_excess_, at(for_shortest_).excess);
  while (at(for_mean_).t_s < t - kMean - 1e-9) ++for_mean_;
  ++count_;
  if (for_shortest_ == 0) return;
  meet(Line::kEnergy, now.excess - least_excess_, 1.1 * store_);
  meet(Line::kMeanPower, (energy_j - at(for_mean_).energy) / kMean, 1.1 * (allowed_.power + store_ / kMean));
}

void Judge::see_let_go(const AtPerson& now, double power) {
  if (now.commanded != 0) {
    torque_off_from_ = now.body;
    reference_known_ = false;
  }
  const double speed = std::fabs(now.body.v);
  const double speed_anyway = 1.1 * allowed_.speed, power_anyway = 1.1 * allowed_.power;
  if (speed <= speed_anyway && power <= power_anyway) {
    meet(Line::kSpeedLetGo, speed, speed_anyway);
    meet(Line::kPowerLetGo, power, power_anyway);
    return;
  }
  if (!reference_known_) {
    const LetGo then = let_go(allowed_.body, let_go_from_), off = let_go(allowed_.body, torque_off_from_);
    reference_ = {std::max(then.speed, off.speed), std::max(then.power, off.power)};
    reference_known_ = true;
  }
  meet(Line::kSpeedLetGo, speed, std::max(speed_anyway, 1.1 * reference_.speed));
  meet(Line::kPowerLetGo, power, std::max(power_anyway, 1.1 * reference_.power));
}

void Judge::see(const TickTrace<1>& now, double t_s) {
  const TickTrace<1>& was = trace_before_;
  if (traced_) {
    const double dt = t_s - trace_t_s_;
    const bool changed = now.state != was.state;
    const bool looks = changed || (changed_ && now.state != StationState::kEngaged);
    if (looks && drives(now.state)) {
      const double late = stood_ ? 2 : 1;
      const auto allowed = [&](double v) { return late * std::clamp(v, -allowed_.speed, allowed_.speed); };
      meet(Line::kJump,
           unexplained_step(now.target.x[0] - was.target.x[0], dt,
                            {was.local.v[0], now.local.v[0], allowed(was.target.v[0]), allowed(now.target.v[0]),
                             allowed(was.remote.v[0]), allowed(now.remote.v[0])}),
           1e-3);
    }
    if (changed && now.state == StationState::kHolding) x_hold_ = now.local.x[0];
    changed_ = changed;
    stood_ = now.remote.x[0] == was.remote.x[0];
    if (now.state == StationState::kEngaged) engaged_s_ += dt;
    if (now.state == StationState::kHolding && t_s > last_packet_s_ + kPressedAfter) {
      meet(Line::kPressed, std::fabs(before_.torque), allowed_.hold_spring * std::fabs(x_hold_ - before_.body.x) + 0.1);
    }
  }
  trace_before_ = now;
  trace_t_s_ = t_s;
  traced_ = true;
}

}  // namespace farhand::rogue
