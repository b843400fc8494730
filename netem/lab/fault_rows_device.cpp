// The rows of the matrix on the patient's side: the serial cable, the orthosis with its MCU and sensors, encoders.
#include <algorithm>
#include <cmath>

#include "netem/lab/fault_expectations.hpp"

namespace farhand::faults {

void add_serial(Catalogue& all) {
  all.add(
      "serial cable unplugged and plugged in", kEvenStopped, [](R& r, N s) { r.cable.plugged = !during(s); },
      [](At at) { return device_lost(at, kTickMs, kMcu); });
  all.add(
      "nothing from the MCU", {At::kFree, At::kContact, At::kHolding}, [](R& r, N s) { r.cable.from_mcu = !during(s); },
      [](At at) { return device_lost(at, kSerial, kSerial + kCableMs + kRamp + kTickMs); });
  all.add(
      "nothing to the MCU", {At::kFree, At::kContact, At::kHolding}, [](R& r, N s) { r.cable.to_mcu = !during(s); },
      [](At at) { return device_lost(at, kMcu + kCableMs, kMcu); });
  // A line that lags by 20 ms more than it needs is known 50 ms later. Where commands cease meanwhile the MCU lets go.
  constexpr double kPassed = 20, kKnown = 50, kLate = 40;
  const auto late = [](N Cable::*way) {
    return [way](R& r, N s) { r.cable.*way = during(s, kSecond / 2) ? from_seconds(1e-3 * kLate) : 0; };
  };
  all.add("commands 40 ms late for half a second", kAtWork, late(&Cable::lag_to_mcu),
          [](At at) { return device_lost(at, kPassed + kKnown, kPassed + kKnown + kLate + kStop); });
  all.add("telemetry 40 ms late for half a second", {At::kFree, At::kContact, At::kHolding}, late(&Cable::lag_from_mcu),
          [](At at) { return device_lost(at, kPassed + kKnown, kPassed + kKnown + kStop); });
  const auto later_and_later = [](N Cable::*way) {
    return [way](R& r, N s) { r.cable.*way = std::min(s / 10, 60 * kMillisecond); };
  };
  constexpr double kGrown = 200 + kKnown, kThere = 25;  // when the lag is 20 ms; what it is at most once that is known
  const auto too_slow = [](double let_go_ms) {
    return [=](At at) { return with(sensor_wrong(at, Reason::kLineSlow, kGrown, let_go_ms), Remedy::kRepair); };
  };
  all.add("commands ever later, up to 60 ms", kAtWork, later_and_later(&Cable::lag_to_mcu),
          too_slow(kGrown + kThere + kStop));
  all.add("telemetry ever later, up to 60 ms", kAtWork, later_and_later(&Cable::lag_from_mcu),
          too_slow(kGrown + kStop));
  const auto noise = [](double share) { return [share](R& r, N s) { r.cable.noise = during(s) ? share : 0; }; };
  all.add("serial: 2 % of the bytes damaged", kAtWork, noise(0.02), rides);
  all.add("serial: nothing but garbage", {At::kReady, At::kFree, At::kContact}, noise(1),
          [](At at) { return device_lost(at, kSerial, kMcu); });
}

void add_orthosis(Catalogue& all) {
  const auto once = [](auto act) {
    return [act](R& r, N s) {
      if (s == 0) act(*r.orthosis());
    };
  };
  using O = OrthosisEmulator;
  // What is over before the therapist's device is aligned is not seen while aligning.
  const auto lost_for = [](double within_ms, double let_go_ms) {
    return [=](At at) { return at == At::kAligning ? rides(at) : device_lost(at, within_ms, let_go_ms); };
  };
  const auto broken = [](Reason reason, double within_ms, Remedy remedy) {
    return [=](At at) { return with(sensor_wrong(at, reason, within_ms, within_ms + kRamp), remedy); };
  };
  const Reason jump = Reason::kEncoderJump, spring = Reason::kSpringDisagrees;
  // An MCU that was SAFE is so again before anybody misses it.
  all.add("MCU reset", kEvenStopped, once([](O& o) { o.reset_mcu(mcu::kExternalReset); }),
          [&](At at) { return at == At::kReady ? rides(at) : lost_for(kCableMs + kTickMs, kTickMs)(at); });
  all.add(
      "brown-out of 200 ms", kEvenStopped, [](R& r, N s) { r.orthosis()->supply(!during(s, 200 * kMillisecond)); },
      lost_for(kSerial + kCableMs, kTickMs));
  constexpr double kChipWatchdog = 15;
  all.add("MCU hangs", kAtWork, once([](O& o) { o.hang_mcu(); }),
          lost_for(kChipWatchdog + kCableMs + kTickMs, kChipWatchdog + kTickMs));

  const auto off_for = [](O::Encoder& (O::*encoder)() noexcept, N span) {
    return [=](R& r, N s) { (r.orthosis()->*encoder)().off = during(s, span) ? 637 : 0; };
  };
  constexpr N kForever = 1000 * kSecond;
  const double at_once = kCableMs + kTickMs;
  all.add("joint encoder off by 0.2 rad for 5 ms", kEverywhere, off_for(&O::joint_encoder, 5 * kMillisecond),
          broken(jump, at_once, Remedy::kPowerOff));
  all.add("motor encoder off by 0.2 rad for 5 ms", kAtWork, off_for(&O::motor_encoder, 5 * kMillisecond),
          broken(jump, at_once, Remedy::kPowerOff));
  all.add("joint encoder slips by 0.2 rad", kEverywhere, off_for(&O::joint_encoder, kForever),
          broken(jump, at_once, Remedy::kRepair));
  all.add("motor encoder slips by 0.2 rad", kAtWork, off_for(&O::motor_encoder, kForever),
          broken(jump, at_once, Remedy::kRepair));
  // Encoders and the spring's own sensor may differ by 0.5 N m for 20 ms. At 0.6 rad/s a frozen encoder makes them
  // differ so in 83 ms; when nothing moves nobody can tell, and nothing is wrong.
  constexpr double kApart = 83 + 20, kSensor = 20;
  all.add("joint encoder frozen", {At::kFree}, once([](O& o) { o.joint_encoder().frozen = true; }),
          broken(spring, kApart + at_once, Remedy::kRepair));
  all.add("motor encoder frozen", {At::kFree}, once([](O& o) { o.motor_encoder().frozen = true; }),
          broken(spring, kApart + at_once, Remedy::kRepair));
  // Of a hand that is pressed only what the observers make of the noise goes round, until the host sees no angle
  // follow.
  all.add("joint encoder frozen", {At::kContact}, once([](O& o) { o.joint_encoder().frozen = true; }), [&](At at) {
    return with_master(broken(Reason::kEncoderFrozen, 900, Remedy::kRepair)(at), Reason::kPeerFault);
  });
  all.add("motor encoder frozen", {At::kContact}, once([](O& o) { o.motor_encoder().frozen = true; }),
          broken(spring, 250, Remedy::kRepair));
  all.add("spring sensor dead", {At::kContact, At::kHolding}, once([](O& o) { o.spring_sensor().factor = 0; }),
          broken(spring, kSensor + at_once, Remedy::kRepair));
  all.add("spring sensor dead", {At::kFree}, once([](O& o) { o.spring_sensor().factor = 0; }), rides);
  all.add("spring sensor's wires swapped", {At::kContact, At::kHolding},
          once([](O& o) { o.spring_sensor().factor = -1; }), broken(spring, kSensor + at_once, Remedy::kRepair));
  // What shows the right torque is not found wrong before the torque has changed by 0.5 N m.
  all.add("spring sensor stuck", {At::kContact}, once([](O& o) { o.spring_sensor().stuck = true; }), rides);
  all.add(
      "spring sensor stuck, then the hand is let go", {At::kContact},
      [](R& r, N s) {
        if (s == 0) r.orthosis()->spring_sensor().stuck = true, r.act = OperatorAct::kHold;
        if (s == kSecond / 10) r.patient_act = OperatorAct::kStop;
      },
      [&](At at) { return with_master(broken(spring, 200, Remedy::kRepair)(at), Reason::kOperator); });
  const auto snap = [](R& r, N s) {
    if (s == 0) r.break_spring();
  };
  all.add("spring broken", {At::kContact, At::kHolding}, snap, broken(spring, kSensor + at_once, Remedy::kRepair));
  all.add("spring broken", {At::kReady}, snap, [](At at) { return with(rides(at), Remedy::kRepair); });
  all.add("spring broken", {At::kFree}, snap, broken(spring, kApart + at_once, Remedy::kRepair));

  const auto pressed = [](At at) { return with(device_gone(at, 3, 3), Remedy::kRelease); };
  all.add("patient's stop", kEverywhere, once([](O& o) { o.press_stop(true); }), pressed);
  all.add(
      "patient's stop without network", {At::kContact},
      [](R& r, N s) {
        r.forward.cut = r.backward.cut = during(s);
        if (s == 0) r.orthosis()->press_stop(true);
      },
      [&](At at) { return with_master(pressed(at), Reason::kPeerSilent); });
  all.add(
      "patient's stop, slave killed", {At::kContact},
      [](R& r, N s) {
        if (s == 0) r.slave.runs = false, r.orthosis()->press_stop(true);
        if (s == kSecond) r.restart_slave();
      },
      [](At) {
        return Expected{S::kOff, S::kHolding, Reason::kStart, Reason::kPeerSilent, 1000 + kTickMs, 3, Remedy::kRelease};
      });
}

void add_encoders(Catalogue& all) {
  const auto first = all.rows.size();
  const auto slave_reads = [](double off) {
    return [off](R& r, N s) {
      r.slave_reading = during(s) ? [off](double x) { return x + off; } : std::function<double(double)>();
    };
  };
  const auto slave_fault = [](At at) {
    return Expected{S::kFault,
                    at == At::kReady ? S::kReady : S::kHolding,
                    Reason::kNotFinite,
                    at == At::kReady     ? Reason::kTested
                    : at == At::kHolding ? Reason::kOperator
                                         : Reason::kPeerFault,
                    kTickMs,
                    kTickMs,
                    Remedy::kReset};
  };
  all.add("slave's encoder says NaN", kEverywhere, slave_reads(kNan), slave_fault);
  all.add("slave's encoder says infinity", kAtWork, slave_reads(kInf), slave_fault);
  const auto wrong = [&](Reason reason, double within_ms) {
    return [=](At at) {
      Expected e = slave_fault(at);
      e.slave_reason = reason, e.within_ms = within_ms, e.let_go_within_ms = within_ms;
      return e;
    };
  };
  all.add("slave's encoder off by 20 mrad", kEverywhere, slave_reads(0.02), wrong(Reason::kEncoderJump, kTickMs));
  const auto freeze = [](R& r, N s) {
    if (s == 0) {
      r.slave_reading = [shown = kNan](double x) mutable { return shown = std::isnan(shown) ? x : shown; };
    } else if (!during(s)) {
      r.slave_reading = nullptr;
    }
  };
  all.add("slave's encoder frozen", {At::kFree}, freeze, wrong(Reason::kEncoderFrozen, 4));
  // Of a hand that is pressed or held little moves, and it shows later.
  all.add("slave's encoder frozen", {At::kContact, At::kHolding}, freeze, wrong(Reason::kEncoderFrozen, 900));
  all.add("slave's encoder frozen", {At::kReady}, freeze, rides);
  for (auto k = first; k < all.rows.size(); ++k) all.rows[k].direct = true;

  const auto master_reads = [](double off) {
    return [off](R& r, N s) {
      r.master_reading = during(s) ? [off](double x) { return x + off; } : std::function<double(double)>();
    };
  };
  const auto master_fault = [](At at) {
    Expected e{S::kReady, S::kFault, Reason::kTested, Reason::kNotFinite, 0, 0, Remedy::kReset};
    if (at_work(at)) e.slave = S::kHolding, e.slave_reason = Reason::kPeerFault, e.within_ms = kFlight + kTickMs;
    return e;
  };
  all.add("master's encoder says NaN", {At::kReady, At::kAligning, At::kFree, At::kContact}, master_reads(kNan),
          master_fault);
}

// The box gives no more than it is set to, whatever is asked of it; the limits are set so low that they are met.
void add_limits(Catalogue& all) {
  const auto nothing = [](R&, N) {};
  const auto met = [&](const char* limit, std::initializer_list<At> states, std::vector<std::string> sets,
                       const auto& expect) {
    const auto first = all.rows.size();
    all.add(limit, states, nothing, expect);
    for (auto k = first; k < all.rows.size(); ++k) {
      all.rows[k].sets = sets;
      all.rows[k].watch = 8 * kSecond;
    }
  };
  const auto rests = [](Remedy remedy) {
    return [=](At) {
      return Expected{S::kHolding, S::kHolding, Reason::kPatientLimit, Reason::kPeerLetGo, 8000, 0, remedy};
    };
  };
  met("energy of a minute given", {At::kFree}, {"slave.limits.energy_j_per_min=0.02"}, rests(Remedy::kRest));
  met("motor as warm as it may be", {At::kContact},
      {"slave.limits.motor_continuous_a=0.12", "slave.limits.motor_overload_s=20"}, rests(Remedy::kRest));
  met("session over", kAtWork, {"slave.limits.session_s=6"}, rests(Remedy::kReset));
}

}  // namespace farhand::faults
