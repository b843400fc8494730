// The rows of the matrix: network, processes, operator. A fault lasts one second unless its name says otherwise; then
// it is over, and the operator engages again.
#include <cmath>

#include "common/config/schema.hpp"
#include "netem/lab/fault_expectations.hpp"

namespace farhand::faults {
namespace {

void add_network(Catalogue& all) {
  all.add(
      "network cut", kEvenStopped, [](R& r, N s) { r.forward.cut = r.backward.cut = during(s); }, silent);
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
  // What would throw the hand about is cut to the limits of this side before anything follows it.
  all.add("packets say 1e6 rad/s", {At::kFree, At::kContact}, says(0, 1e6, 0), rides);
  all.add("packets say 1e6 N m", kAtWork, says(0, 0, 1e6), rides);
  all.add(
      "packets shake the hand by 120 mrad at 6 Hz", {At::kFree, At::kContact, At::kHolding},
      [](R& r, N s) {
        const double swing = 2 * M_PI * 6, phase = swing * to_seconds(s);
        const auto speak = [=](Packet<1>& packet) {
          packet.motion.x[0] += 0.12 * std::sin(phase);
          packet.motion.v[0] += 0.12 * swing * std::cos(phase);
        };
        r.forward.content = during(s, 2 * kSecond) ? speak : decltype(r.forward.content)();
      },
      // In contact the bound at the hand takes off much of it, and what is left is known later, within its 2 s.
      [](At at) { return at == At::kHolding ? rides(at) : shaken(at == At::kFree ? 1250 : 2000); });
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
  all.add("master killed and started again", kEvenStopped, killed(true, false), [](At at) {
    Expected e = at == At::kReady || at == At::kAligning ? rides(At::kReady) : silent(at);
    e.master = S::kReady, e.master_reason = Reason::kTested;
    return e;
  });
  all.add("slave killed and started again", kEvenStopped, killed(false, true), [](At at) {
    Expected e = silent(at);
    e.slave = S::kReady, e.slave_reason = Reason::kTested;
    e.within_ms = 1000 + kTickMs;
    e.let_go_within_ms = at_work(at) || at == At::kHolding ? kMcu : 0;
    e.remedy = Remedy::kNothing;  // even if it was Stopped: who starts it is at the patient's box
    return e;
  });
  all.add("both killed and started again", {At::kReady, At::kFree, At::kContact, At::kHolding}, killed(true, true),
          [](At) {
            Expected e = rides(At::kReady);
            e.within_ms = 1000 + kTickMs;
            e.let_go_within_ms = kMcu;
            return e;
          });

  const auto stopped = [](bool master, bool slave, N span) {
    return [=](R& r, N s) {
      if (master) r.master.runs = s >= span;
      if (slave) r.slave.runs = s >= span;
    };
  };
  for (const double seconds : {0.05, 0.5, 5.0}) {
    const N span = from_seconds(seconds);
    const bool brief = span < 100 * kMillisecond;  // shorter than what counts as silence
    const std::string name = " stopped for " + shortest(seconds) + " s";
    const double ms = std::max(seconds * 1e3, kMcu + kCableMs) + kTickMs;
    const auto lets_go = [&](At at) {
      return with_master(device_lost(at, ms, kMcu), brief ? Reason::kPeerLetGo : Reason::kPeerSilent);
    };
    const auto first = all.rows.size();
    all.add("master" + name, kAtWork, stopped(true, false, span),
            [&](At at) { return brief ? rides(at) : silent(at); });
    all.add("slave" + name, kAtWork, stopped(false, true, span), lets_go);
    all.add("both" + name, {At::kContact}, stopped(true, true, span), lets_go);
    for (auto k = first; k < all.rows.size(); ++k) all.rows[k].watch = span + kSecond;
  }

  const auto set_clock = [](Process R::*process, N by) {
    return [=](R& r, N s) {
      if (s == 0) (r.*process).clock = by;
    };
  };
  // A clock that goes forward believes that nothing came for long; one that goes back hears stamps that look early and
  // sends some that look old. Both sides let go, the other one a flight later, until echoes prove what comes fresh.
  constexpr N kHour = 3600 * kSecond;
  const auto within = [](double ms) {
    return [ms](At at) {
      Expected e = silent(at);
      e.within_ms = ms + kTickMs;
      return e;
    };
  };
  all.add("clock of the slave set forward by 1 h", kAtWork, set_clock(&R::slave, kHour), within(0));
  all.add("clock of the master set forward by 1 h", kAtWork, set_clock(&R::master, kHour), within(kFlight));
  all.add("clock of the slave set back by 1 h", kAtWork, set_clock(&R::slave, -kHour), within(2 * kFlight));
  all.add("clock of the master set back by 1 h", kAtWork, set_clock(&R::master, -kHour), within(kFlight));
}

void add_operator(Catalogue& all) {
  const auto acts = [](OperatorAct act) {
    return [act](R& r, N s) {
      if (s == 0) r.act = act;
    };
  };
  all.add("operator stops", {At::kAligning, At::kFree, At::kContact, At::kHolding}, acts(OperatorAct::kStop),
          [](At at) {
            Expected e{S::kReady, S::kStopped, Reason::kPeerStopped, Reason::kOperator, kFlight + kTickMs};
            if (at == At::kAligning) e.slave_reason = Reason::kTested, e.within_ms = 0;
            if (at == At::kHolding) e.slave = S::kHolding, e.slave_reason = Reason::kPeerLetGo, e.within_ms = 0;
            return with(e, Remedy::kReset);
          });
  all.add("operator holds", {At::kAligning, At::kFree, At::kContact}, acts(OperatorAct::kHold), [](At at) {
    Expected e{S::kHolding, S::kHolding, Reason::kPeerLetGo, Reason::kOperator, kFlight + kTickMs};
    if (at == At::kAligning) e.slave = S::kReady, e.slave_reason = Reason::kTested, e.within_ms = 0;
    return e;
  });
}

void add_patients_stop(Catalogue& all) {
  const auto pressed = [](At at) {
    Expected e{S::kStopped, S::kHolding, Reason::kOperator, Reason::kPeerStopped, kTickMs, kStop, Remedy::kReset};
    if (at == At::kReady) e.master = S::kReady, e.master_reason = Reason::kTested;
    if (at == At::kHolding) e.master_reason = Reason::kOperator;
    return e;
  };
  const auto press = [](R& r, N s) {
    if (s == 0) r.patient_act = OperatorAct::kStop;
  };
  all.add("stop at the patient's box", kEverywhere, press, pressed);
  const auto first = all.rows.size();
  all.add("stop at the patient's box", kEverywhere, press, pressed);
  for (auto k = first; k < all.rows.size(); ++k) all.rows[k].direct = true;
  all.add(
      "stop at the patient's box without network", {At::kContact},
      [](R& r, N s) {
        r.forward.cut = r.backward.cut = during(s);
        if (s == 0) r.patient_act = OperatorAct::kStop;
      },
      [&](At at) { return with_master(pressed(at), Reason::kPeerSilent); });
}

}  // namespace

std::vector<Row> rows() {
  Catalogue all;
  add_network(all);
  add_processes(all);
  add_serial(all);
  add_orthosis(all);
  add_encoders(all);
  add_limits(all);
  add_operator(all);
  add_patients_stop(all);
  return std::move(all.rows);
}

std::vector<Elsewhere> elsewhere() {
  return {
      {"kill -9 of master", "engaged", "holding: peer silent; every flushed sample recovered",
       "Stories.MasterKilledThePatientIsHeldUntilItIsBack"},
      {"kill -9 of slave", "engaged", "the MCU lets go by its own watchdog",
       "Stories.SlaveKilledTheMcuLetsGoAndTheTherapistIsHeld"},
      {"kill -9 of the network", "engaged", "both hold", "Stories.NetemKilledBothSidesHold"},
      {"kill -9 of the MCU's emulator", "engaged", "off: device lost; the therapist's side holds",
       "Stories.McuKilledTheSlaveLetsGoAndTheMasterHolds"},
      {"4 s without network", "engaged", "both hold until the operator engages",
       "StoriesOfTheNetwork.EverythingIsLostForFourSeconds"},
      {"kills, SIGSTOP, patient's stop at random", "any", "safe recordings, flat memory",
       "NightlyRoughSession.EveryMishapOnceIsSurvivedSafely"},
      {"limits of power, position, speed and torque met", "engaged", "engaged: less of what the peer asks for",
       "OnEitherDevice.Power"},
      {"cable pulled", "any", "noticed by the next call", "Serial.APulledCableIsNoticedByTheNextCallAndStaysNoticed"},
      {"disk full", "any", "the loop goes on, what is missing is counted", "Recorder.GoesOnWhenTheDiskIsFull"},
      {"recorder killed", "any", "no flushed chunk is lost", "Recorder.LosesNoFlushedChunkWhenKilled"},
      {"wrong key, other settings", "start", "refused with a sentence that names it",
       "Pairing.TheWrongKeyAndOtherSettingsAreRefusedByASentence"},
      {"patient's box restarted, or behind another address", "engaged", "heard again after a new handshake",
       "Secured.ARestartedBoxAndOneBehindANewAddressAreHeardAgain"},
      {"repeated, forged and foreign packets", "engaged", "no effect",
       "Secured.RepetitionsForgeriesAndForeignSendersHaveNoEffect"},
      {"brown-out of the chip", "engaged", "safe, at the right angle, and told",
       "Firmware.ABrownOutEndsInSafeAtTheRightAngleAndIsTold"},
      {"loop of the chip hangs", "engaged", "reset by its watchdog within 20 ms",
       "Firmware.ALoopThatHangsIsResetByTheWatchdogWithinTwentyMilliseconds"},
  };
}

}  // namespace farhand::faults
