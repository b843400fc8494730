// The rows of the matrix. A fault lasts one second unless its name says otherwise; then it is over, and the operator
// engages again.
#include <initializer_list>

#include "tests/lab/fault_matrix.hpp"

namespace farhand::faults {
namespace {

using R = FaultRig;
using N = Nanoseconds;
using S = StationState;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// The promises, in ms. What is under way when the network is cut still arrives.
constexpr double kFlight = 30, kTickMs = 1, kCableMs = 2;
constexpr double kNetwork = kFlight + 100 + kTickMs;
constexpr double kSerial = 50 + kTickMs;
constexpr double kMcu = kCableMs + 20 + 50 + kTickMs;
constexpr double kRamp = 50;

const std::initializer_list<At> kEverywhere{At::kReady, At::kAligning, At::kFree, At::kContact, At::kHolding};
const std::initializer_list<At> kAtWork{At::kFree, At::kContact};

bool at_work(At at) { return at == At::kFree || at == At::kContact; }

// Nothing happens to the state.
Expected rides(At at) {
  switch (at) {
    case At::kReady:
      return {S::kReady, S::kReady, Reason::kStart, Reason::kStart};
    case At::kHolding:
      return {S::kHolding, S::kHolding, Reason::kPeerLetGo, Reason::kOperator};
    case At::kAligning:  // and comes to its end meanwhile
      return {S::kEngaged, S::kEngaged, Reason::kPeerEngaged, Reason::kAligned, 2000};
    default:
      return {S::kEngaged, S::kEngaged, Reason::kPeerEngaged, Reason::kAligned};
  }
}

Expected silent(At at) {
  if (at == At::kAligning) return {S::kReady, S::kHolding, Reason::kStart, Reason::kPeerSilent};
  if (!at_work(at)) return rides(at);
  return {S::kHolding, S::kHolding, Reason::kPeerSilent, Reason::kPeerSilent, kNetwork};
}

Expected with_master(Expected e, Reason reason) {
  e.master_reason = reason;
  return e;
}
// One side notices, the other hears of it one flight later.
Expected deaf_slave(At at) {
  // The therapist's device aligns with what it hears, and waits for a patient's side that does not.
  if (at == At::kAligning) return {S::kReady, S::kEngaged, Reason::kStart, Reason::kAligned};
  return at_work(at) ? with_master(silent(at), Reason::kPeerLetGo) : rides(at);
}
Expected deaf_master(At at) {
  Expected e = silent(at);
  if (at_work(at)) e.slave_reason = Reason::kPeerLetGo, e.within_ms += kFlight;
  return e;
}

// The slave lost its device.
Expected device_lost(At at, double within_ms, double let_go_within_ms) {
  if (at == At::kReady) return rides(at);
  Expected e{S::kReady, S::kHolding, Reason::kDeviceLost, Reason::kPeerLetGo, within_ms, let_go_within_ms};
  if (at == At::kHolding) e.master_reason = Reason::kOperator;
  if (at == At::kAligning) e = deaf_slave(at);
  return e;
}
Expected with(Expected e, Remedy remedy) {
  e.remedy = remedy;
  return e;
}

struct Catalogue {
  std::vector<Row> rows;

  template <class Expect>
  void add(const std::string& fault, std::initializer_list<At> states, Fault act, const Expect& expect) {
    for (const At at : states) rows.push_back({fault, at, act, expect(at)});
  }
};

bool during(N since, N span = kSecond) { return since < span; }

void add_network(Catalogue& all) {
  all.add(
      "network cut", kEverywhere, [](R& r, N s) { r.forward.cut = r.backward.cut = during(s); }, silent);
  all.add(
      "cut from therapist to patient", {At::kAligning, At::kFree, At::kContact},
      [](R& r, N s) { r.forward.cut = during(s); }, deaf_slave);
  all.add(
      "cut from patient to therapist", {At::kAligning, At::kFree, At::kContact},
      [](R& r, N s) { r.backward.cut = during(s); }, deaf_master);
  all.add(
      "network cut for 80 ms", kAtWork,
      [](R& r, N s) { r.forward.cut = r.backward.cut = during(s, 80 * kMillisecond); }, rides);

  // Everything queues somewhere and then comes at once.
  const auto queue_for = [](N span) {
    return [span](R& r, N s) {
      for (Way* way : {&r.forward, &r.backward}) way->delay = 30 * kMillisecond + std::max<N>(0, span - s);
    };
  };
  all.add("storm: 80 ms of packets at once", kAtWork, queue_for(80 * kMillisecond), rides);
  all.add("storm: 1 s of packets at once", kAtWork, queue_for(kSecond), silent);
  all.add(
      "storm: every packet 50 times", {At::kReady, At::kFree, At::kContact},
      [](R& r, N s) {
        const auto flood = [](Way& way, Letter letter) {
          for (int k = 0; k < 50; ++k) way.post(letter);
        };
        r.forward.carry = r.backward.carry = during(s) ? flood : decltype(r.forward.carry)();
      },
      rides);
  all.add(
      "stale: everything 3 s old", kAtWork,
      [](R& r, N s) { r.forward.delay = r.backward.delay = during(s) ? 3 * kSecond : 30 * kMillisecond; }, silent);

  all.add(
      "each packet repeated 50 ms later", kAtWork,
      [](R& r, N) {
        r.forward.carry = r.backward.carry = [](Way& way, Letter letter) {
          way.post(letter);
          letter.due += 50 * kMillisecond;
          way.post(letter);
        };
      },
      rides);
  // The stream of an engaged therapist, again, once the patient holds.
  all.add(
      "replay of the last second after a cut", kAtWork,
      [](R& r, N s) {
        r.backward.cut = during(s);
        const auto twice = [](Way& way, Letter letter) {
          way.post(letter);
          letter.due += kSecond;
          way.post(letter);
        };
        r.forward.carry = s < kSecond / 2 ? twice : decltype(r.forward.carry)();
      },
      deaf_master);
  all.add(
      "order changed by 20 ms", kAtWork,
      [](R& r, N) {
        r.forward.carry = r.backward.carry = [](Way& way, Letter letter) {
          if (letter.due / kMillisecond % 2 == 0) letter.due += 20 * kMillisecond;
          way.post(letter);
        };
      },
      rides);
  const auto flip = [](int one_in) {
    return [one_in](R& r, N s) {
      const auto damage = [one_in](Way& way, Letter letter) {
        if (letter.due / kMillisecond % one_in == 0) {
          const auto bit = static_cast<std::size_t>(letter.due / kMillisecond) % (8 * letter.bytes.size());
          letter.bytes[bit / 8] ^= std::byte{1} << (bit % 8);
        }
        way.post(letter);
      };
      r.forward.carry = r.backward.carry = during(s) ? damage : decltype(r.forward.carry)();
    };
  };
  all.add("corrupt: a bit in every third packet", kAtWork, flip(3), rides);
  all.add("corrupt: a bit in every packet", {At::kReady, At::kFree, At::kContact}, flip(1), silent);
  all.add(
      "every packet truncated", {At::kContact},
      [](R& r, N s) {
        const auto cut = [](Way& way, Letter letter) {
          letter.bytes.resize(letter.bytes.size() / 2);
          way.post(letter);
        };
        r.forward.carry = r.backward.carry = during(s) ? cut : decltype(r.forward.carry)();
      },
      silent);

  // An authentic therapist's station that says nonsense.
  const auto says = [](double x, double v, double f) {
    return [=](R& r, N s) {
      const auto speak = [=](Packet<1>& packet) {
        packet.motion.x[0] += x;
        packet.motion.v[0] += v;
        packet.motion.f[0] += f;
      };
      r.forward.content = during(s) ? speak : decltype(r.forward.content)();
    };
  };
  all.add("packets say NaN", {At::kReady, At::kFree, At::kContact}, says(kNan, 0, 0), deaf_slave);
  all.add("packets say an infinite torque", kAtWork, says(0, 0, kInf), deaf_slave);
  all.add("packets say 1000 rad", kAtWork, says(1000, 0, 0), rides);
  all.add("packets say 1e6 rad/s", kAtWork, says(0, 1e6, 0), rides);
  all.add("packets say 1e6 N m", kAtWork, says(0, 0, 1e6), rides);
  all.add(
      "wrong key", {At::kReady, At::kContact},
      [](R& r, N s) {
        if (s == 0) r.change_key();
      },
      [](At at) { return with(silent(at), Remedy::kRepair); });
}

void add_processes(Catalogue& all) {
  const auto killed = [](bool master, bool slave) {
    return [=](R& r, N s) {
      if (s == 0 && master) r.master.runs = false;
      if (s == 0 && slave) r.slave.runs = false;
      if (s == kSecond && master) r.restart_master();
      if (s == kSecond && slave) r.restart_slave();
    };
  };
  all.add("master killed and started again", kEverywhere, killed(true, false), [](At at) {
    Expected e = at == At::kReady || at == At::kAligning ? rides(At::kReady) : silent(at);
    e.master = S::kReady, e.master_reason = Reason::kStart;
    return e;
  });
  all.add("slave killed and started again", kEverywhere, killed(false, true), [](At at) {
    Expected e = silent(at);
    e.slave = S::kReady, e.slave_reason = Reason::kStart;
    e.within_ms = at_work(at) || at == At::kHolding ? 1000 + kTickMs : 0;
    e.let_go_within_ms = at_work(at) || at == At::kHolding ? kMcu : 0;
    return e;
  });
  all.add("both killed and started again", {At::kReady, At::kFree, At::kContact, At::kHolding}, killed(true, true),
          [](At at) {
            Expected e = rides(At::kReady);
            e.within_ms = at == At::kReady ? 0 : 1000 + kTickMs;
            e.let_go_within_ms = kMcu;
            return e;
          });

  const auto stopped = [](bool master, bool slave, N span) {
    return [=](R& r, N s) {
      if (master) r.master.runs = s >= span;
      if (slave) r.slave.runs = s >= span;
    };
  };
  struct Stall {
    const char* name;
    N span;
    Reason master_of_slave, master_of_both;
  };
  for (const Stall& stall : {Stall{"50 ms", 50 * kMillisecond, Reason::kPeerLetGo, Reason::kPeerLetGo},
                             Stall{"0.5 s", kSecond / 2, Reason::kPeerSilent, Reason::kPeerLetGo},
                             Stall{"5 s", 5 * kSecond, Reason::kPeerSilent, Reason::kPeerSilent}}) {
    const bool brief = stall.span<100 * kMillisecond, lasting = stall.span> kSecond;
    const double ms = std::max(to_seconds(stall.span) * 1e3, kMcu + kCableMs) + kTickMs;
    const auto lets_go = [&](Reason master) {
      return [=](At at) { return with_master(device_lost(at, ms, kMcu), master); };
    };
    const auto first = all.rows.size();
    all.add(std::string("master stopped for ") + stall.name, kAtWork, stopped(true, false, stall.span), [&](At at) {
      return brief ? rides(at) : lasting ? silent(at) : deaf_slave(at);
    });
    all.add(std::string("slave stopped for ") + stall.name, kAtWork, stopped(false, true, stall.span),
            lets_go(stall.master_of_slave));
    all.add(std::string("both stopped for ") + stall.name, {At::kContact}, stopped(true, true, stall.span),
            lets_go(stall.master_of_both));
    for (auto k = first; k < all.rows.size(); ++k) all.rows[k].watch = stall.span + kSecond;
  }

  const auto set_clock = [](Process R::*process, N by) {
    return [=](R& r, N s) {
      if (s == 0) (r.*process).clock = by;
    };
  };
  // Whose clock goes forward believes that nothing came for long; whose clock goes back sends stamps that contradict
  // their order. In both cases one side takes everything for expired until there is a new session.
  constexpr N kHour = 3600 * kSecond;
  all.add("clock of the slave set forward by 1 h", kAtWork, set_clock(&R::slave, kHour), [](At at) {
    Expected e = deaf_slave(at);
    e.within_ms = kTickMs;
    return with(e, Remedy::kRestart);
  });
  all.add("clock of the master set forward by 1 h", kAtWork, set_clock(&R::master, kHour), [](At at) {
    Expected e = deaf_master(at);
    e.within_ms = kFlight + kTickMs;
    return with(e, Remedy::kRestart);
  });
  all.add("clock of the slave set back by 1 h", kAtWork, set_clock(&R::slave, -kHour),
          [](At at) { return with(deaf_master(at), Remedy::kRestart); });
  all.add("clock of the master set back by 1 h", kAtWork, set_clock(&R::master, -kHour),
          [](At at) { return with(deaf_slave(at), Remedy::kRestart); });
}

void add_serial(Catalogue& all) {
  // Plugged in while the therapist's station waits, the slave engages at once; its MCU wants to hear SAFE first.
  all.add(
      "serial cable unplugged and plugged in", kEverywhere, [](R& r, N s) { r.cable.plugged = !during(s); },
      [](At at) {
        if (at == At::kAligning) return device_lost(At::kFree, 1000 + kTickMs, kMcu);
        return device_lost(at, kTickMs, kMcu);
      });
  all.add(
      "nothing from the MCU", {At::kFree, At::kContact, At::kHolding}, [](R& r, N s) { r.cable.from_mcu = !during(s); },
      [](At at) { return device_lost(at, kSerial, kSerial + kCableMs + kRamp + kTickMs); });
  all.add(
      "nothing to the MCU", {At::kFree, At::kContact, At::kHolding}, [](R& r, N s) { r.cable.to_mcu = !during(s); },
      [](At at) { return device_lost(at, kMcu + kCableMs, kMcu); });
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
  const auto broken = [](double within_ms, Remedy remedy) {
    return [=](At at) { return with(device_lost(at, within_ms, within_ms + kRamp), remedy); };
  };
  all.add("MCU reset", kEverywhere, once([](O& o) { o.reset_mcu(mcu::kExternalReset); }),
          lost_for(kCableMs + kTickMs, kTickMs));
  all.add(
      "brown-out of 200 ms", kEverywhere, [](R& r, N s) { r.orthosis()->supply(!during(s, 200 * kMillisecond)); },
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
          broken(at_once, Remedy::kPowerOff));
  all.add("motor encoder off by 0.2 rad for 5 ms", kAtWork, off_for(&O::motor_encoder, 5 * kMillisecond),
          broken(at_once, Remedy::kPowerOff));
  all.add("joint encoder slips by 0.2 rad", kEverywhere, off_for(&O::joint_encoder, kForever),
          broken(at_once, Remedy::kRepair));
  all.add("motor encoder slips by 0.2 rad", kAtWork, off_for(&O::motor_encoder, kForever),
          broken(at_once, Remedy::kRepair));
  // Encoders and the spring's own sensor may differ by 0.5 N m for 20 ms. At 0.6 rad/s a frozen encoder makes them
  // differ so in 83 ms; when nothing moves nobody can tell, and nothing is wrong.
  constexpr double kApart = 83 + 20, kSensor = 20;
  all.add("joint encoder frozen", {At::kFree}, once([](O& o) { o.joint_encoder().frozen = true; }),
          broken(kApart + at_once, Remedy::kRepair));
  all.add("motor encoder frozen", {At::kFree}, once([](O& o) { o.motor_encoder().frozen = true; }),
          broken(kApart + at_once, Remedy::kRepair));
  all.add("joint encoder frozen", {At::kContact}, once([](O& o) { o.joint_encoder().frozen = true; }), rides);
  all.add("motor encoder frozen", {At::kContact}, once([](O& o) { o.motor_encoder().frozen = true; }),
          broken(250, Remedy::kRepair));
  all.add("spring sensor dead", {At::kContact, At::kHolding}, once([](O& o) { o.kill_spring_sensor(); }),
          broken(kSensor + at_once, Remedy::kRepair));
  all.add("spring sensor dead", {At::kFree}, once([](O& o) { o.kill_spring_sensor(); }), rides);
  const auto snap = [](R& r, N s) {
    if (s == 0) r.break_spring();
  };
  all.add("spring broken", {At::kReady, At::kContact, At::kHolding}, snap, broken(kSensor + at_once, Remedy::kRepair));
  all.add("spring broken", {At::kFree}, snap, broken(kApart + at_once, Remedy::kRepair));

  const auto pressed = [](At at) { return with(device_lost(at, 3, 3), Remedy::kRelease); };
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
        return Expected{S::kReady,      S::kHolding, Reason::kStart,  Reason::kPeerSilent,
                        1000 + kTickMs, 3,           Remedy::kRelease};
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
                    at == At::kReady     ? Reason::kStart
                    : at == At::kHolding ? Reason::kOperator
                                         : Reason::kPeerFault,
                    kTickMs,
                    kTickMs,
                    Remedy::kReset};
  };
  all.add("slave's encoder says NaN", kEverywhere, slave_reads(kNan), slave_fault);
  all.add("slave's encoder says infinity", kAtWork, slave_reads(kInf), slave_fault);
  for (auto k = first; k < all.rows.size(); ++k) all.rows[k].direct = true;

  const auto master_reads = [](double off) {
    return [off](R& r, N s) {
      r.master_reading = during(s) ? [off](double x) { return x + off; } : std::function<double(double)>();
    };
  };
  const auto master_fault = [](At at) {
    Expected e{S::kReady, S::kFault, Reason::kStart, Reason::kNotFinite, 0, 0, Remedy::kReset};
    if (at_work(at)) e.slave = S::kHolding, e.slave_reason = Reason::kPeerFault, e.within_ms = kFlight + kTickMs;
    return e;
  };
  all.add("master's encoder says NaN", {At::kReady, At::kAligning, At::kFree, At::kContact}, master_reads(kNan),
          master_fault);
}

void add_operator(Catalogue& all) {
  const auto acts = [](OperatorAct act) {
    return [act](R& r, N s) {
      if (s == 0) r.act = act;
    };
  };
  all.add("operator stops", {At::kAligning, At::kFree, At::kContact, At::kHolding}, acts(OperatorAct::kStop),
          [](At at) {
            Expected e{S::kReady, S::kReady, Reason::kPeerLetGo, Reason::kOperator, kFlight + kTickMs};
            if (at == At::kAligning) return with_master(rides(At::kReady), Reason::kOperator);
            if (at == At::kHolding) e.slave = S::kHolding, e.within_ms = 0;
            return e;
          });
  all.add("operator holds", {At::kAligning, At::kFree, At::kContact}, acts(OperatorAct::kHold), [](At at) {
    Expected e{S::kHolding, S::kHolding, Reason::kPeerLetGo, Reason::kOperator, kFlight + kTickMs};
    if (at == At::kAligning) e.slave = S::kReady, e.slave_reason = Reason::kStart, e.within_ms = 0;
    return e;
  });
}

}  // namespace

std::vector<Row> rows() {
  Catalogue all;
  add_network(all);
  add_processes(all);
  add_serial(all);
  add_orthosis(all);
  add_encoders(all);
  add_operator(all);
  return std::move(all.rows);
}

std::vector<Elsewhere> elsewhere() { return {}; }

}  // namespace farhand::faults
