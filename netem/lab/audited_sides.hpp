// The simulated sides of a scene with an account of the energy of both worlds. They compute the same numbers as those
// without.
#pragma once

#include "netem/lab/energy_audit.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

struct Balances {
  EnergyBalance master, slave;
};

// `balances` must outlive the sides.
Sides make_audited_sides(const scene::Scene& scene, Balances& balances);

}  // namespace farhand
