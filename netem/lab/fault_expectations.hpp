// Common parts of the rows of the matrix: the promised times, and the result of each class of faults in each state.
#pragma once

#include <initializer_list>
#include <limits>

#include "netem/lab/fault_matrix.hpp"

namespace farhand::faults {

using R = FaultRig;
using N = Nanoseconds;
using S = StationState;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

// The promised times, in ms. Packets that are under way when the network is cut still arrive.
inline constexpr double kFlight = 30, kTickMs = 1, kCableMs = 2;
inline constexpr double kNetwork = kFlight + 100 + kTickMs;
inline constexpr double kSerial = 50 + kTickMs;
inline constexpr double kMcu = kCableMs + 20 + 50 + kTickMs;
inline constexpr double kRamp = 50;
inline constexpr double kStop = 4;  // one frame of 1.5 ms and 2 ms, seen at the next tick

inline const std::initializer_list<At> kEverywhere{At::kReady, At::kAligning, At::kFree, At::kContact, At::kHolding};
inline const std::initializer_list<At> kEvenStopped{At::kReady,   At::kAligning, At::kFree,
                                                    At::kContact, At::kHolding,  At::kStopped};
inline const std::initializer_list<At> kAtWork{At::kFree, At::kContact};

inline bool at_work(At at) { return at == At::kFree || at == At::kContact; }

// Nothing happens to the state.
inline Expected rides(At at) {
  switch (at) {
    case At::kReady:
      return {S::kReady, S::kReady, Reason::kTested, Reason::kTested};
    case At::kHolding:
      return {S::kHolding, S::kHolding, Reason::kPeerLetGo, Reason::kOperator};
    case At::kStopped:
      return {S::kStopped, S::kHolding, Reason::kOperator, Reason::kPeerStopped, 0, 0, Remedy::kReset};
    case At::kAligning:  // and comes to its end meanwhile
      return {S::kEngaged, S::kEngaged, Reason::kPeerEngaged, Reason::kAligned, 2000};
    default:
      return {S::kEngaged, S::kEngaged, Reason::kPeerEngaged, Reason::kAligned};
  }
}

inline Expected silent(At at) {
  if (at == At::kAligning) return {S::kReady, S::kHolding, Reason::kTested, Reason::kPeerSilent};
  if (!at_work(at)) return rides(at);
  return {S::kHolding, S::kHolding, Reason::kPeerSilent, Reason::kPeerSilent, kNetwork};
}

inline Expected with_master(Expected e, Reason reason) {
  e.master_reason = reason;
  return e;
}
// One side detects the fault, the other one gets its packet one flight later.
inline Expected deaf_slave(At at) {
  // The therapist's device aligns with the motion that it receives, and waits for a patient's side that does not
  // engage.
  if (at == At::kAligning) return {S::kReady, S::kEngaged, Reason::kTested, Reason::kAligned};
  return at_work(at) ? with_master(silent(at), Reason::kPeerDeaf) : rides(at);
}
inline Expected deaf_master(At at) {
  Expected e = silent(at);
  if (at_work(at)) e.slave_reason = Reason::kPeerDeaf, e.within_ms += kFlight;
  return e;
}

// The slave lost its device, found it again and tested it.
inline Expected device_lost(At at, double within_ms, double let_go_within_ms) {
  if (at == At::kStopped) return rides(at);
  Expected e{S::kReady, S::kHolding, Reason::kTested, Reason::kPeerLetGo, within_ms, let_go_within_ms};
  if (at == At::kReady) e.master = S::kReady, e.master_reason = Reason::kTested;
  if (at == At::kHolding) e.master_reason = Reason::kOperator;
  if (at == At::kAligning) e.master = S::kEngaged, e.master_reason = Reason::kAligned;
  return e;
}
// It lost its device for good.
inline Expected device_gone(At at, double within_ms, double let_go_within_ms) {
  if (at == At::kStopped) return rides(at);
  Expected e = device_lost(at, within_ms, let_go_within_ms);
  e.slave = S::kOff, e.slave_reason = Reason::kDeviceLost;
  return e;
}
// The MCU, or the side itself, found a faulty sensor. The MCU is in a fault at once and reports the reason at most 16
// ms later.
inline Expected sensor_wrong(At at, Reason reason, double within_ms, double let_go_within_ms) {
  Expected e = device_lost(at, within_ms, let_go_within_ms);
  e.slave = S::kFault, e.slave_reason = reason;
  if (at == At::kAligning) e.master = S::kHolding, e.master_reason = Reason::kPeerFault;
  return e;
}
// The guard holds a hand that is shaken.
inline Expected shaken(double within_ms) {
  return {S::kHolding, S::kHolding, Reason::kShaken, Reason::kPeerLetGo, within_ms};
}
inline Expected with(Expected e, Remedy remedy) {
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

inline bool during(N since, N span = kSecond) { return since < span; }

void add_serial(Catalogue& all);
void add_orthosis(Catalogue& all);
void add_encoders(Catalogue& all);
void add_limits(Catalogue& all);

}  // namespace farhand::faults
