// Whole sessions of a scene over ranges of its settings, on all cores, with the metrics that `run` prints for each.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "netem/lab/workload.hpp"

namespace farhand {

// One axis of a sweep: settings that take the same values together.
struct SweptAxis {
  std::vector<std::string> fields;
  double from = 0, to = 0;
  std::size_t count = 1;

  // Both ends included.
  double at(std::size_t k) const;
};

struct SweepAsked {
  std::string scene;              // name or path
  std::vector<std::string> sets;  // field.path=value, the same for all
  std::vector<SweptAxis> axes;    // the last one varies fastest
  std::optional<std::uint64_t> seed;

  std::size_t scenes() const;
};

// "a.b=from:to:count", or "a.b,c.d=from:to:count" for settings that change together, is an axis; every other text is a
// setting. Throws std::invalid_argument for an invalid range, for a field that is given twice, and for more than a
// million scenes.
SweepAsked swept(const std::string& scene, const std::vector<std::string>& sets, std::optional<std::uint64_t> seed);

struct Swept {
  std::size_t rows = 0;     // written; fewer than requested if a signal ended the work
  std::size_t refused = 0;  // of them: scenes that `run` refuses
  std::size_t failed = 0;   // whose verdict is failed
};

// Writes a table with a row for each scene, in order, as soon as it and those before it are done: the swept values
// (columns "set.FIELD"), the sentence of a refusal, the warnings, and every metric of `run --json` with the same
// digits. The bytes are the same for any number of threads. Throws the refusal of the first scene if the last one is
// refused too, and std::runtime_error as soon as a row cannot be written.
Swept sweep(const SweepAsked& asked, const Workload& work, std::ostream& out);

}  // namespace farhand
