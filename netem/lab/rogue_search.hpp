// The search: looks in one cell for the genomes that do the most to the person, and learns from what it found.
//
// An evolution strategy with an elite for every line of the judge. A new genome comes from chance (a twentieth, and all
// of the first ones), from two elites (a tenth), or from one by changes whose number and size adapt: they grow where a
// child surpasses its parent and shrink where it does not. One session is compared with the elites of all lines,
// because what breaks one limit is often near to what breaks another. Where nothing is gained for long the elite of
// that line is put aside and the search of the line starts again from chance. Nothing but the seed enters: the same
// numbers on every machine and for any number of threads.
#pragma once

#include <functional>
#include <vector>

#include "netem/lab/rogue_session.hpp"
#include "netem/lab/workload.hpp"

namespace farhand::rogue {

struct Found {
  Worst worst;
  Genome genome;
  int session = -1;  // which one of the cell; -1: none
};

struct CellResult {
  Cell cell;
  int sessions = 0;
  int engaged = 0;  // for at least 0.5 s
  int crossed = 0;  // sessions in which a line with a bound was crossed
  int restarts = 0;
  double virtual_s = 0;
  std::array<Found, kLines> found;  // the worst of each line

  bool fine() const noexcept { return crossed == 0; }
};

struct Budget {
  int sessions = 1000;  // in each cell
  std::uint64_t seed = 1;
  double longer = 1;  // how much longer an attack lasts
};

// What is searched is behind a function, so that a test can put something in its place whose worst is known.
using Trial = std::function<Outcome(const Genome&)>;
CellResult search(const Cell& cell, const Trial& trial, int sessions, std::uint64_t seed);
std::vector<CellResult> search(const std::vector<Cell>& cells, const Budget& budget, const Workload& work,
                               const std::vector<std::string>& sets = {});

// What stands in a table of rows and on the command line: the cell, a space, the genome.
struct Row {
  Cell cell;
  Genome genome;
};
std::string text_of(const Row& row);
Row row_of(const std::string& text);

}  // namespace farhand::rogue
