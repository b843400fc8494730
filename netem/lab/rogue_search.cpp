#include "netem/lab/rogue_search.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace farhand::rogue {
namespace {

constexpr int kPatience = 120;      // children of a line without a gain, then it starts again
constexpr std::size_t kElites = 3;  // of each line
constexpr double kFirst = 0.12;     // of the budget are drawn by chance alone
constexpr double kOfChance = 0.05, kOfTwo = 0.10;

struct Elite {
  Genome genome;
  double score = -1;
};

// What the search knows of one line.
struct Climb {
  std::vector<Elite> elites;  // the best first
  double step = 0.15;         // of a gene, as a share of its range
  double changes = 8;         // genes that change, on average
  int idle = 0;

  void offer(const Genome& genome, double score) {
    if (elites.size() == kElites && score <= elites.back().score) return;
    for (const Elite& e : elites) {
      if (e.score == score) return;  // the same in what counts
    }
    elites.push_back({genome, score});
    std::ranges::stable_sort(elites, std::ranges::greater{}, &Elite::score);
    if (elites.size() > kElites) elites.pop_back();
  }
};

std::uint16_t gene_of(double share) {
  return static_cast<std::uint16_t>(std::clamp(std::floor(share * kGeneValues), 0.0, kGeneValues - 1.0));
}

Genome mutated(Genome genome, const Climb& climb, Dice& dice) {
  const double share = climb.changes / kGenes;
  bool changed = false;
  while (!changed) {
    for (std::uint16_t& gene : genome.genes) {
      if (uniform(dice) >= share) continue;
      changed = true;
      const double now = (gene + 0.5) / kGeneValues;
      gene = uniform(dice) < 0.25 ? gene_of(uniform(dice)) : gene_of(now + climb.step * normal(dice));
    }
  }
  if (uniform(dice) < 0.08) {  // a segment takes the place of another
    const auto at = [&](std::size_t k) {
      return genome.genes.begin() + static_cast<std::ptrdiff_t>(kSessionGenes + k * kSegmentGenes);
    };
    const std::size_t from = pick(dice, kSegments), to = pick(dice, kSegments);
    if (from != to) std::copy_n(at(from), kSegmentGenes, at(to));
  }
  return genome;
}

// The session of one, segments of either.
Genome mixed(const Genome& a, const Genome& b, Dice& dice) {
  Genome child = a;
  for (std::size_t k = 0; k < kSegments; ++k) {
    if (uniform(dice) < 0.5) continue;
    const auto from = static_cast<std::ptrdiff_t>(kSessionGenes + k * kSegmentGenes);
    std::copy_n(b.genes.begin() + from, kSegmentGenes, child.genes.begin() + from);
  }
  if (uniform(dice) < 0.3) std::copy_n(b.genes.begin(), kSessionGenes, child.genes.begin());
  return child;
}

std::uint64_t hash_of(const std::string& text) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

}  // namespace

CellResult search(const Cell& cell, const Trial& trial, int sessions, std::uint64_t seed) {
  Dice dice(seed ^ hash_of(name_of(cell)));
  CellResult result;
  result.cell = cell;
  std::array<Climb, kLines> climbs;
  for (int n = 0; n < sessions; ++n) {
    const std::size_t line = static_cast<std::size_t>(n) % kLines;
    Climb& climb = climbs[line];
    const double way = uniform(dice);
    Genome genome;
    double to_beat = -1;
    if (n < kFirst * sessions || climb.elites.empty() || way < kOfChance) {
      genome = random_genome(dice);
    } else if (way < kOfChance + kOfTwo) {
      const Climb& other = climbs[pick(dice, kLines)];
      const Climb& second = other.elites.empty() ? climb : other;
      genome = mixed(climb.elites[pick(dice, climb.elites.size())].genome,
                     second.elites[pick(dice, second.elites.size())].genome, dice);
    } else {  // the best half of the time
      const std::size_t which = uniform(dice) < 0.5 ? 0 : pick(dice, climb.elites.size());
      to_beat = climb.elites[which].score;
      genome = mutated(climb.elites[which].genome, climb, dice);
    }

    const Outcome outcome = trial(genome);
    ++result.sessions;
    result.virtual_s += outcome.lasted_s;
    result.engaged += outcome.engaged_s >= 0.5;
    result.crossed += outcome.ratio() > 1.0;
    const double best = climb.elites.empty() ? -1 : climb.elites.front().score;
    for (std::size_t k = 0; k < kLines; ++k) {
      const Worst& worst = outcome.findings[k];
      if (worst.ratio > result.found[k].worst.ratio) result.found[k] = {worst, genome, n};
      if (worst.ratio > 0) climbs[k].offer(genome, worst.ratio);
    }
    const double score = outcome.findings[line].ratio;
    if (to_beat >= 0) {
      const bool better = score > to_beat * (1 + 1e-6);
      climb.step = std::clamp(climb.step * (better ? 1.3 : 0.96), 0.01, 0.4);
      climb.changes = std::clamp(climb.changes * (better ? 1.2 : 0.98), 1.5, 30.0);
    }
    climb.idle = score > best * (1 + 1e-3) ? 0 : climb.idle + 1;
    if (climb.idle > kPatience) {
      climb = {};
      ++result.restarts;
    }
  }
  return result;
}

std::vector<CellResult> search(const std::vector<Cell>& cells, const Budget& budget, const Workload& work,
                               const std::vector<std::string>& sets) {
  std::vector<CellResult> results(cells.size());
  const std::size_t all = cells.size() * static_cast<std::size_t>(budget.sessions);
  work.require_all(work.each_of(all, cells.size(), [&](std::size_t k) {
    const Arena arena(cells[k], sets, budget.longer);
    const auto trial = [&](const Genome& genome) {
      work.require_all(!work.stopped());
      work.done_one();
      return arena.run(genome);
    };
    results[k] = search(cells[k], trial, budget.sessions, budget.seed);
  }));
  return results;
}

std::string text_of(const Row& row) { return name_of(row.cell) + ' ' + text_of(row.genome); }

Row row_of(const std::string& text) {
  const std::size_t space = text.find(' ');
  if (space == std::string::npos) throw std::invalid_argument("a row is a cell, a space and a genome");
  return {cell_of(text.substr(0, space)), genome_of(text.substr(space + 1))};
}

}  // namespace farhand::rogue
