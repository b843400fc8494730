#include "netem/lab/rogue_genome.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace farhand::rogue {
namespace {
constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
static_assert(kDigits.size() * kDigits.size() == kGeneValues);
}  // namespace

std::string text_of(const Genome& genome) {
  std::string text;
  for (const std::uint16_t gene : genome.genes) {
    text += kDigits[gene / kDigits.size()];
    text += kDigits[gene % kDigits.size()];
  }
  return text;
}

Genome genome_of(std::string_view text) {
  if (text.size() != 2 * kGenes && text.size() != 2 * kFirstGenes) {
    throw std::invalid_argument("a genome has " + std::to_string(2 * kGenes) + " characters (an older one " +
                                std::to_string(2 * kFirstGenes) + "), this one has " + std::to_string(text.size()));
  }
  Genome genome;
  for (std::size_t k = 0; 2 * k < text.size(); ++k) {
    std::size_t value = 0;
    for (const char c : text.substr(2 * k, 2)) {
      const std::size_t digit = kDigits.find(c);
      if (digit == std::string_view::npos)
        throw std::invalid_argument(std::string("'") + c + "' is in no genome: A-Z a-z 0-9 - _ are");
      value = value * kDigits.size() + digit;
    }
    genome.genes[k] = static_cast<std::uint16_t>(value);
  }
  return genome;
}

double normal(Dice& dice) noexcept {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(dice)));
  return radius * std::cos(2.0 * std::numbers::pi * uniform(dice));
}

Genome random_genome(Dice& dice) {
  Genome genome;
  for (std::uint16_t& gene : genome.genes) gene = static_cast<std::uint16_t>(pick(dice, kGeneValues));
  return genome;
}

double GeneReader::logarithmic(double low, double high) { return low * std::pow(high / low, share()); }

}  // namespace farhand::rogue
