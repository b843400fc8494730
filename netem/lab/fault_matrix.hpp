// The fault matrix: each fault in each state, with the reaction of both sides, its time, and the largest torque, speed
// and jump at the hand. Every row states its result beforehand; all rows run in virtual time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "netem/lab/fault_rig.hpp"
#include "netem/lab/workload.hpp"

namespace farhand::faults {

enum class At { kReady, kAligning, kFree, kContact, kHolding, kStopped };
const char* name_of(At at);

// Acts that are needed before the operator's ENGAGE has both sides engaged again. If it is not kNothing, ENGAGE alone
// must not suffice.
enum class Remedy {
  kNothing,
  kReset,     // RESET, at the side that is in Fault or Stopped or whose session is over
  kRest,      // a minute without energy for the hand
  kRelease,   // the patient's release key
  kPowerOff,  // the orthosis is switched off and on, and RESET at the patient's side: both latched a fault
  kRepair,    // none without tools
};
const char* name_of(Remedy remedy);

struct Expected {
  StationState slave, master;  // at the end of the watch
  Reason slave_reason, master_reason;
  double within_ms = 0;         // the slave leaves the state that it was in; 0: it must not
  double let_go_within_ms = 0;  // no torque is commanded to the hand any more; 0: not required
  Remedy remedy = Remedy::kNothing;
};

// since: 0 in the first tick that the fault touches.
using Fault = std::function<void(FaultRig& rig, Nanoseconds since)>;

struct Row {
  std::string fault;
  At at;
  Fault act;
  Expected expected;
  Nanoseconds watch = 2 * kSecond;
  bool direct = false;  // a direct drive instead of the orthosis behind its MCU
  std::vector<std::string> sets = {};
};

struct Result {
  const Row* of;
  StationState slave, master;
  Reason slave_reason, master_reason;
  double slave_ms, master_ms;  // until each left the state that it was in; NaN: never
  double let_go_ms;            // until nothing was commanded; NaN: never
  double torque_nm, velocity_rad_s,
      jump_rad;           // largest values after the fault, at the hand; jump of the motion to follow
  bool by_itself;         // the patient's side was engaged again without an act
  bool without_remedy;    // engaged again although a remedy should have been needed
  bool again;             // engaged again with the remedy
  std::string complaint;  // what is not as expected; empty: as expected
};

inline constexpr double kTorqueLimit = 3;  // N m, of the patient's side in the scene of the matrix
inline constexpr double kJumpLimit = 1e-3;

std::vector<Row> rows();
Result run(const Row& row);
std::vector<Result> run(const std::vector<Row>& rows, const Workload& work);  // in the order of the rows
std::string complaint(const Row& row, const Result& result);

// Faults that need an operating system, and the test of each.
struct Elsewhere {
  const char *fault, *state, *outcome, *test;
};
std::vector<Elsewhere> elsewhere();

}  // namespace farhand::faults
