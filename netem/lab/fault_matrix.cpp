#include "netem/lab/fault_matrix.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "netem/lab/unexplained_step.hpp"

namespace farhand::faults {
namespace {

constexpr const char* kScene = R"(
architecture: FOUR_CHANNEL_CDOB_SDCV
duration_s: 100
control { f_1_nm: 0.2 f_2_nm: 0.45 }
slave { axis { torque_limit_nm: 3 } }
network {
  forward { delay_s: 0.03 distribution: CONSTANT }
  backward { delay_s: 0.03 distribution: CONSTANT }
}
)";
constexpr double kNever = std::numeric_limits<double>::quiet_NaN();
constexpr Nanoseconds kLongAlignment = 2500 * kMillisecond;  // a second to settle, half a second of play-out, the way
constexpr Nanoseconds kPatience = 8 * kSecond;               // one attempt may have to time out first
constexpr Nanoseconds kSettle = 300 * kMillisecond;
constexpr Nanoseconds kStays = kSecond;  // twice the soft start, before which nothing is under load

scene::Scene scene_of(const Row& row) {
  std::vector<std::string> sets;
  if (!row.direct) sets = {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125"};
  // Rest until both are engaged, then either a free sine or a press on the hand with 1 N m: the arm of 10 N m/rad and
  // the hand of 5 meet at 0.2 rad.
  const bool contact = row.at >= At::kContact;
  sets.push_back("master.therapist.grip=FIRM");
  sets.push_back("master.therapist.intended={duration_s: 2.5}");
  if (contact) {
    sets.push_back("slave.hand={stiffness_nm_per_rad: 5}");
    sets.push_back("master.therapist.intended={duration_s: 0.5 ramp_to_rad: 0.3}");
    sets.push_back("master.therapist.intended={duration_s: 1000}");
  } else {
    sets.push_back("master.therapist.intended={duration_s: 1000 sine_amplitude_rad: 0.25 sine_frequency_hz: 0.5}");
  }
  sets.insert(sets.end(), row.sets.begin(), row.sets.end());
  return load_scene_text(kScene, "faults.txtpb", sets).scene;
}

// The largest step of the motion to follow where a step would come from us: at each change of state and the tick after
// it, and all the time while aligning and holding; in engagement the target is the other hand.
class JumpMeter {
 public:
  void see(const Process& process) {
    if (!process.runs) return;
    const TickTrace<1>& now = process.side->trace();
    const bool same = process.side.get() == side_;
    const bool driven = asks_of(now.state) == Asks::kMotion;
    const bool changed = now.state != before_.state;
    if (same && driven && (changed || changed_ || now.state != StationState::kEngaged)) {
      const double dt = to_seconds(process.ticked - ticked_);
      worst =
          std::max(worst, unexplained_step(now.target.x[0] - before_.target.x[0], dt,
                                           {before_.local.v[0], now.local.v[0], before_.remote.v[0], now.remote.v[0]}));
    }
    changed_ = same && changed;
    before_ = now;
    side_ = process.side.get();
    ticked_ = process.ticked;
  }

  double worst = 0;

 private:
  const Side* side_ = nullptr;
  TickTrace<1> before_;
  Nanoseconds ticked_ = 0;
  bool changed_ = false;
};

class Course {
 public:
  explicit Course(const Row& row) : row_(row), rig_(scene_of(row)) {}

  Result run() {
    reach();
    Result& r = result_;
    r.of = &row_;
    r.slave_ms = r.master_ms = r.let_go_ms = kNever;
    const StationState slave_was = state(rig_.slave), master_was = state(rig_.master);
    const Nanoseconds from = rig_.now + kMillisecond;
    from_ = from;
    while (rig_.now < from + row_.watch) {
      step();
      const double ms = static_cast<double>((rig_.now - from) / kMillisecond);
      if (std::isnan(r.slave_ms) && rig_.slave.runs && state(rig_.slave) != slave_was) r.slave_ms = ms;
      r.by_itself |=
          !std::isnan(r.slave_ms) && slave_was != StationState::kReady && state(rig_.slave) == StationState::kEngaged;
      if (std::isnan(r.master_ms) && rig_.master.runs && state(rig_.master) != master_was) r.master_ms = ms;
      if (std::isnan(r.let_go_ms) && rig_.lets_go()) r.let_go_ms = ms;
    }
    r.slave = state(rig_.slave);
    r.master = state(rig_.master);
    r.slave_reason = rig_.slave.side->trace().reason;
    r.master_reason = rig_.master.side->trace().reason;
    engage_again();
    r.torque_nm = torque_;
    r.velocity_rad_s = velocity_;
    r.jump_rad = std::max(master_jump_.worst, slave_jump_.worst);
    r.complaint = complaint(row_, r);
    return r;
  }

 private:
  static StationState state(const Process& process) { return process.side->trace().state; }
  bool both(StationState wanted) const { return state(rig_.master) == wanted && state(rig_.slave) == wanted; }

  void step() {
    if (from_ > 0) row_.act(rig_, rig_.now + kMillisecond - from_);
    rig_.tick();
    if (from_ == 0) return;
    torque_ = std::max(torque_, rig_.torque());
    velocity_ = std::max(velocity_, std::abs(rig_.velocity()));
    master_jump_.see(rig_.master);
    slave_jump_.see(rig_.slave);
  }
  template <class Condition>
  bool until(const Condition& condition, Nanoseconds patience) {
    for (const Nanoseconds end = rig_.now + patience; rig_.now < end;) {
      step();
      if (condition()) return true;
    }
    return false;
  }
  void wait(Nanoseconds span) {
    until([] { return false; }, span);
  }

  void reach() {
    const auto must = [&](const auto& condition) {
      if (!until(condition, 10 * kSecond)) throw std::logic_error(row_.fault + ": never came to " + name_of(row_.at));
    };
    must([&] {
      return rig_.master.side->receiver().heard() && rig_.slave.side->receiver().heard() && both(StationState::kReady);
    });
    wait(kSettle);
    if (row_.at == At::kReady) return;
    rig_.act = OperatorAct::kEngage;
    must([&] { return state(rig_.master) == StationState::kAligning; });
    wait(kSettle);
    if (row_.at == At::kAligning) return;
    must([&] { return both(StationState::kEngaged); });
    if (row_.at == At::kFree) {
      must([&] { return std::abs(rig_.velocity()) > 0.6; });
      return;
    }
    must([&] { return std::abs(rig_.slave.side->truth().f) > 0.9; });
    wait(kSettle);
    if (row_.at == At::kContact) return;
    if (row_.at == At::kStopped) {
      rig_.patient_act = OperatorAct::kStop;
      must([&] { return state(rig_.slave) == StationState::kStopped && state(rig_.master) == StationState::kHolding; });
      wait(kSettle);
      return;
    }
    rig_.act = OperatorAct::kHold;
    must([&] { return both(StationState::kHolding); });
    wait(kSettle);
  }

  // The operator engages whenever that is possible.
  bool engages(Nanoseconds patience) {
    const auto engaged = [&] {
      const StationState master = state(rig_.master);
      if (master == StationState::kReady || master == StationState::kHolding) rig_.act = OperatorAct::kEngage;
      return both(StationState::kEngaged);
    };
    return until(engaged, patience) && !until([&] { return !both(StationState::kEngaged); }, kStays);
  }

  // ENGAGE alone suffices exactly where nothing else is asked for; then the remedy, and ENGAGE again.
  void engage_again() {
    const Remedy remedy = row_.expected.remedy;
    const bool alone = both(StationState::kEngaged) || engages(remedy == Remedy::kNothing ? kPatience : kLongAlignment);
    if (remedy == Remedy::kNothing) {
      result_.again = alone;
      return;
    }
    result_.without_remedy = alone;
    if (remedy == Remedy::kRepair) return;
    OrthosisEmulator* const orthosis = rig_.orthosis();
    if (remedy == Remedy::kReset) {
      rig_.patient_act = rig_.act = OperatorAct::kReset;
    } else if (remedy == Remedy::kRest) {
      wait(61 * kSecond);
    } else if (remedy == Remedy::kRelease) {
      orthosis->press_stop(false);
      orthosis->press_release(true);
      wait(kSecond);
      orthosis->press_release(false);
    } else {
      orthosis->supply(false);
      wait(100 * kMillisecond);
      orthosis->supply(true);
      wait(kSettle);
      rig_.patient_act = OperatorAct::kReset;
    }
    wait(kSettle);
    result_.again = engages(kPatience);
  }

  const Row& row_;
  FaultRig rig_;
  Result result_{};
  Nanoseconds from_ = 0;  // of the fault
  double torque_ = 0, velocity_ = 0;
  JumpMeter master_jump_, slave_jump_;
};

}  // namespace

const char* name_of(At at) {
  constexpr const char* kNames[] = {"ready", "aligning", "engaged, free", "engaged, contact", "holding", "stopped"};
  return kNames[static_cast<int>(at)];
}

const char* name_of(Remedy remedy) {
  constexpr const char* kNames[] = {
      "engage", "reset, engage", "a minute's rest, engage", "release key, engage", "orthosis off and on, reset, engage",
      "repair"};
  return kNames[static_cast<int>(remedy)];
}

Result run(const Row& row) { return Course(row).run(); }

std::vector<Result> run(const std::vector<Row>& rows, const Workload& work) {
  std::vector<Result> results(rows.size());
  work.require_all(work.each(rows.size(), [&](std::size_t k) { results[k] = run(rows[k]); }));
  return results;
}

std::string complaint(const Row& row, const Result& r) {
  const Expected& e = row.expected;
  const auto both = [](const char* who, StationState state, Reason reason) {
    return std::string(who) + " " + farhand::name_of(state) + ": " + farhand::name_of(reason);
  };
  if (!(r.torque_nm <= kTorqueLimit)) return "torque of " + shortest(r.torque_nm) + " N m";
  if (!(r.jump_rad <= kJumpLimit)) return "jump of " + shortest(1e3 * r.jump_rad) + " mrad";
  if (r.slave != e.slave || r.slave_reason != e.slave_reason)
    return both("slave", r.slave, r.slave_reason) + " instead of " + both("", e.slave, e.slave_reason);
  if (r.master != e.master || r.master_reason != e.master_reason)
    return both("master", r.master, r.master_reason) + " instead of " + both("", e.master, e.master_reason);
  if (e.within_ms == 0 ? !std::isnan(r.slave_ms) : !(r.slave_ms <= e.within_ms))
    return "slave reacts after " + shortest(r.slave_ms) + " ms, expected " + shortest(e.within_ms);
  if (e.let_go_within_ms > 0 && !(r.let_go_ms <= e.let_go_within_ms))
    return "lets go after " + shortest(r.let_go_ms) + " ms, expected " + shortest(e.let_go_within_ms);
  if (r.by_itself) return "engaged again by itself";
  if (r.without_remedy) return std::string("engages without ") + name_of(e.remedy);
  if (!r.again && e.remedy != Remedy::kRepair) return std::string("does not engage again after ") + name_of(e.remedy);
  return "";
}

}  // namespace farhand::faults
