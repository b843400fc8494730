// Whole sessions of a scene over ranges of its settings, on all cores: of each the metrics that `run` prints of it.
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
  std::vector<SweptAxis> axes;    // the last one runs fastest
  std::optional<std::uint64_t> seed;

  std::size_t scenes() const;
};

// "a.b=from:to:count", or "a.b,c.d=from:to:count" for settings that go together, is an axis; everything else is a
// setting. Throws std::invalid_argument for a range that is none, for a field that is given twice, and where there are
// more than a million scenes.
SweepAsked swept(const std::string& scene, const std::vector<std::string>& sets, std::optional<std::uint64_t> seed);

struct Swept {
  std::size_t rows = 0;     // written; fewer than were asked for where a signal ended the work
  std::size_t refused = 0;  // of them: scenes that `run` refuses
  std::size_t failed = 0;   // whose verdict is failed
};

// A table with a row for each scene, in order, as soon as it and those before it are done: the swept values (columns
// "set.FIELD"), what the scene was refused for or warned of, and every metric of `run --json` with the same digits.
// Same bytes for any number of threads. Throws what the first scene is refused for where the last one is refused too,
// and std::runtime_error as soon as a row cannot be written.
Swept sweep(const SweepAsked& asked, const Workload& work, std::ostream& out);

}  // namespace farhand
