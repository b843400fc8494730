#include "netem/lab/rogue_plan.hpp"

#include <algorithm>
#include <cmath>

namespace farhand::rogue {
namespace {

constexpr double kLegalX = 0.349, kLegalV = 4.0, kLegalF = 3.0;

// Half of all values are such as a sound peer could say, a third is up to a thousand times as large, the rest absurd.
double value(GeneReader& read, double legal) {
  const std::size_t kind = read.choice(std::array{0.45, 0.2, 0.25, 0.1});
  const double u = read.share();
  const double sign = u < 0.5 ? -1.0 : 1.0, size = u < 0.5 ? 1.0 - 2.0 * u : 2.0 * u - 1.0;
  switch (kind) {
    case 0:
      return sign * legal * size;
    case 1:
      return sign * legal;
    case 2:
      return sign * legal * std::pow(10.0, 3.0 * size);
    default:
      return sign * (size < 0.5 ? 1e6 : size < 0.8 ? 1e12 : 1e300);
  }
}

Channel channel(GeneReader& read, double legal) {
  Channel c;
  c.shape = static_cast<Shape>(read.choice(std::array{2.0, 2.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 2.0, 1.5, 1.0, 0.5}));
  c.base = static_cast<Base>(read.choice(std::array{2.0, 2.0, 0.5, 0.5}));
  c.amplitude = value(read, legal);  // two genes
  c.hz = read.logarithmic(0.3, 250.0);
  c.phase = read.share();
  c.lag = static_cast<int>(read.linear(0, 24));
  return c;
}

StationState said_state(GeneReader& read) {
  constexpr std::array kStates{StationState::kEngaged,    StationState::kReady,  StationState::kAligning,
                               StationState::kHolding,    StationState::kFault,  StationState::kOff,
                               StationState::kSelfTest,   StationState::kHoming, StationState::kStopped,
                               StationState::kIdentifying};
  return kStates[read.choice(std::array{24.0, 1.5, 1.0, 1.0, 0.7, 0.4, 0.4, 0.4, 0.7, 0.4})];
}

Segment segment(GeneReader read) {
  Segment s;
  s.duration_s = read.logarithmic(0.003, 1.5);
  s.until = static_cast<Until>(read.choice(std::array{4.0, 1.0, 1.0, 1.0, 1.0}));
  s.state = said_state(read);
  s.other = said_state(read);
  s.flap_hz = read.logarithmic(1.0, 500.0);
  if (!read.chance(0.12)) s.flap_hz = 0;
  s.x = channel(read, kLegalX);
  s.v = channel(read, kLegalV);
  s.f = channel(read, kLegalF);
  s.velocity_of_x = read.chance(0.25);
  s.rhythm = static_cast<Rhythm>(read.choice(std::array{7.0, 1.0, 0.7, 0.5, 0.4}));
  s.gap_s = read.logarithmic(0.002, 0.3);
  s.numbers = static_cast<Numbers>(read.choice(std::array{12.0, 0.3, 0.4, 0.3, 0.3}));
  s.stamps = static_cast<Stamps>(read.choice(std::array{10.0, 0.6, 0.6, 0.5, 0.5, 0.3}));
  s.echoes = static_cast<Echoes>(read.choice(std::array{8.0, 0.5, 0.5, 0.5, 0.5}));
  s.stamp_by = read.logarithmic(0.001, 3.0);
  const double u = read.share();
  s.energy_w = u < 0.4 ? 2.0 : u < 0.6 ? -1.0 : u < 0.8 ? 1e3 : u < 0.95 ? 1e9 : 1e300;
  return s;
}

WorldPlan world(GeneReader& read, Against against) {
  WorldPlan w{};
  const std::size_t kind = read.choice(std::array{1.0, 1.0, 1.0, 1.5, 1.5});
  const double spastic_k = read.linear(1.0, 5.0), grip = read.logarithmic(0.5, 10.0);
  const double spastic = read.chance(0.5) ? 0.3 : 0.5;
  constexpr std::array kLinear{0.5, 2.0, 5.0, 20.0};
  w.damping = 0.02;
  if (against == Against::kTherapist) {  // light 0.5, 0.01; normal 3, 0.06; firm 10, 0.15
    w.stiffness = kind == 0 ? 0.5 : kind == 1 ? 3.0 : kind == 2 ? 10.0 : grip;
    w.damping = w.stiffness <= 3.0 ? 0.02 * w.stiffness : 0.06 + (w.stiffness - 3.0) * 0.09 / 7.0;
  } else if (kind < kLinear.size()) {
    w.stiffness = kLinear[kind];
  } else {
    w.stiffness = spastic_k, w.spastic = spastic;
  }
  w.J_factor = read.linear(0.7, 1.5);
  if (read.chance(0.5)) w.J_factor = 1.0;
  w.motor_speed_limit = read.chance(0.5) ? 4.0 : 8.0;
  w.counts_per_rev = read.chance(0.3) ? 4096.0 : 20000.0;
  const double frozen = read.linear(1.0, 3.0);
  w.frozen_from_s = read.chance(0.2) ? frozen : -1.0;
  return w;
}

Lies lies(GeneReader& read) {
  Lies l;
  l.from_s = read.linear(-0.3, 1.5);
  l.until_s = l.from_s + read.logarithmic(0.005, 2.0);
  l.angle = read.linear(-1.0, 1.0);
  l.angle *= l.angle * l.angle;
  if (!read.chance(0.4)) l.angle = 0;
  l.angle_hz = read.logarithmic(0.3, 200.0);
  l.angle_frozen = read.chance(0.15);
  l.torque_frozen = read.chance(0.15);
  l.torque = read.linear(-3.2, 3.2);
  if (!read.chance(0.5)) l.torque = 0;
  l.torque_hz = read.logarithmic(0.3, 200.0);
  l.torque_factor = read.linear(-2.0, 2.0);
  if (read.chance(0.6)) l.torque_factor = 1.0;
  l.state = static_cast<int>(read.choice(std::array{6.0, 1.0, 1.0, 1.0, 0.5})) - 1;
  l.page = static_cast<int>(read.linear(-24.0, 16.0));
  l.page_value = static_cast<std::uint8_t>(read.linear(0, 256));
  l.to_pc_s = read.logarithmic(0.001, 0.4);
  l.to_mcu_s = read.logarithmic(0.001, 0.4);
  if (!read.chance(0.3)) l.to_pc_s = 0;
  if (!read.chance(0.3)) l.to_mcu_s = 0;
  l.creeping = read.chance(0.5);
  l.seq_lies = read.chance(0.05);
  return l;
}

}  // namespace

// What is read must not depend on what was read before, or a gene would mean one thing in one genome and another thing
// in the next.
Plan plan_of(const Genome& genome, Against against) {
  const std::span<const std::uint16_t> genes(genome.genes);
  GeneReader read(genes.first(kSessionGenes));
  Plan p;
  p.world = world(read, against);
  p.legal = read.chance(0.25);
  p.engage_offset = read.linear(-0.085, 0.085);
  if (read.chance(0.4)) p.engage_offset = 0;
  p.network_s = read.logarithmic(0.001, 0.1);
  if (read.chance(0.6)) p.network_s = 0;
  p.attack_from = static_cast<int>(read.choice(std::array{8.0, 1.0, 0.5}));
  p.engages_again = read.chance(0.75);
  p.repeats = read.chance(0.6);
  p.attack_s = read.linear(0.3, 2.2);
  p.falls_silent = read.chance(0.8);
  p.last.any = read.chance(0.5);
  p.last.x = value(read, kLegalX);
  p.last.v = value(read, kLegalV);
  p.last.f = value(read, kLegalF);
  p.last.state = said_state(read);
  p.last.packets = static_cast<int>(read.logarithmic(1.0, 30.0));
  if (p.legal) {
    p.last.x = std::clamp(p.last.x, -kLegalX, kLegalX);
    p.last.v = std::clamp(p.last.v, -kLegalV, kLegalV);
    p.last.f = std::clamp(p.last.f, -kLegalF, kLegalF);
  }
  p.lies = lies(read);
  GeneReader later(genes.last(kLaterGenes));
  p.claims_gaps = !later.chance(0.6);  // a gene of 0 claims none
  for (std::size_t k = 0; k < kSegments; ++k) {
    p.segments[k] = segment(GeneReader(genes.subspan(kSessionGenes + k * kSegmentGenes, kSegmentGenes)));
  }
  return p;
}

}  // namespace farhand::rogue
