// The genome of a rogue peer: numbers that a search can vary, and a line of text from which the same peer can be made
// again.
//
// Every gene is a whole number of 12 bits. Genes are read in a fixed order, so that a gene always has the same meaning;
// its meaning is documented where it is read (rogue_plan.cpp). Two characters of base64 are one gene.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace farhand::rogue {

inline constexpr std::size_t kSegments = 4;       // actions of the peer, one after the other
inline constexpr std::size_t kSessionGenes = 56;  // the world, and the session as a whole
inline constexpr std::size_t kSegmentGenes = 36;  // of one segment
inline constexpr std::size_t kFirstGenes = kSessionGenes + kSegments * kSegmentGenes;
// Of the session, added since. In an older row, which ends before them, they are 0: the same peer as it was then.
inline constexpr std::size_t kLaterGenes = 1;
inline constexpr std::size_t kGenes = kFirstGenes + kLaterGenes;
inline constexpr std::uint16_t kGeneValues = 4096;

struct Genome {
  std::array<std::uint16_t, kGenes> genes{};
  bool operator==(const Genome&) const = default;
};

std::string text_of(const Genome& genome);
// The text may end after the first genes. Throws std::invalid_argument with the mistake in the text.
Genome genome_of(std::string_view text);

using Dice = std::mt19937_64;
// The same on every machine, which the standard's distributions are not.
inline double uniform(Dice& dice) noexcept { return static_cast<double>(dice() >> 11) * 0x1p-53; }
double normal(Dice& dice) noexcept;
inline std::size_t pick(Dice& dice, std::size_t count) noexcept {
  return static_cast<std::size_t>(uniform(dice) * static_cast<double>(count));
}

Genome random_genome(Dice& dice);

// Reads genes one after the other.
class GeneReader {
 public:
  explicit GeneReader(std::span<const std::uint16_t> genes) : genes_(genes) {}

  // In (0, 1). Throws std::out_of_range if there are no more genes, which is a mistake of the reading code.
  double share() {
    if (next_ == genes_.size()) throw std::out_of_range("a plan reads more genes than there are");
    return (genes_[next_++] + 0.5) / kGeneValues;
  }
  double linear(double low, double high) { return low + (high - low) * share(); }
  double logarithmic(double low, double high);
  bool chance(double probability) { return share() < probability; }
  // Index of one of several choices, by their weights.
  template <std::size_t N>
  std::size_t choice(const std::array<double, N>& weights) {
    double sum = 0;
    for (const double w : weights) sum += w;
    double left = share() * sum;
    for (std::size_t k = 0; k + 1 < N; ++k) {
      if ((left -= weights[k]) < 0) return k;
    }
    return N - 1;
  }

 private:
  std::span<const std::uint16_t> genes_;
  std::size_t next_ = 0;
};

}  // namespace farhand::rogue
