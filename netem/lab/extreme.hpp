// The catalogue of stiff and extreme cases. Each case states its result beforehand: accurate to X against a second
// computation that shares no code with the first, bounded by X with the reason why no more can be promised, or refused
// with a reason. Any other result, better or worse, is not as expected.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "netem/lab/workload.hpp"

namespace farhand::extreme {

// Blocks in which a number can become invalid, in the order of the data flow.
enum class Block {
  kNone,
  kSettings,
  kIntegrator,
  kEncoder,
  kReceiver,
  kObserver,
  kLaw,
  kGate,
  kPacket,
  kLink,
  kMcu,
};
const char* name_of(Block block);

enum class Verdict { kAccurate, kBounded, kRefused };
const char* name_of(Verdict verdict);

struct Expected {
  Verdict verdict;
  double within = 0;   // X; unused by kRefused
  std::string reason;  // kRefused: words that its reason must hold; kBounded: why it is only bounded
  Block first_bad = Block::kNone;
};

// "accurate to 1e-9"
inline Expected accurate(double within) { return {Verdict::kAccurate, within, ""}; }
inline Expected bounded(double by, std::string why) { return {Verdict::kBounded, by, std::move(why)}; }
inline Expected refused(std::string reason, Block first_bad = Block::kNone) {
  return {Verdict::kRefused, 0, std::move(reason), first_bad};
}

struct Outcome {
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

  double error = kNan;     // against the second computation; kBounded: the bounded quantity itself
  std::string unit;        // of error
  std::string second_way;  // the second computation
  std::string what;        // what happened, one sentence
  std::string cell;        // what stands in the table of the family
  std::string refusal;     // why it did not run, or why it stopped; empty: it ran to its end
  Block first_bad = Block::kNone;
  bool bad_at_actuator = false;  // a command that is not finite, which is always an error
  double energy = kNan;          // largest imbalance of a plant over its exchanged energy; NaN: no plant
  double energy_within = 1e-6;   // what its integrator and the quadrature of the balance allow
  std::uint64_t work = 0;        // ticks, or evaluations of a derivative
  std::uint64_t budget = 2'000'000;
};

struct Case {
  std::string family, name;
  Expected expected;
  std::function<Outcome()> run;
  bool quick = true;                  // part of the quick cut
  std::string row = {}, column = {};  // of the table of its family, if it has one
};

// By family, in the order of the catalogue.
std::vector<Case> catalogue();

struct Result {
  const Case* of;
  Outcome outcome;
  std::string complaint;  // what is not as expected; empty: as expected
  double wall_s;          // never part of what is compared between runs
};

std::string complaint(const Expected& expected, const Outcome& outcome);

// Results in the order of `cases`, whatever the number of threads. A case that throws is refused with its sentence.
std::vector<Result> run(const std::vector<Case>& cases, const Workload& work);

}  // namespace farhand::extreme
