// The search: looks in one cell for the genomes with the largest effects on the person, and learns from its results.
//
// It is an evolution strategy with an elite for every limit of the judge. A new genome is random (a twentieth, and all
// of the first ones), is combined from two elites (a tenth), or comes from one elite by changes whose number and size
// adapt: they grow if a child surpasses its parent, and shrink if it does not. Each session is compared with the elites
// of all limits, because a genome that breaks one limit is often near to one that breaks another. If a limit has no
// progress for long, its elite is put aside and its search starts again at random. Only the seed is an input: the
// numbers are the same on every machine and for any number of threads.
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

// The searched function is an argument, so that a test can use a function whose maximum is known.
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
