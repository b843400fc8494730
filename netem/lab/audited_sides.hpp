// The simulated sides of a scene with an energy account of both worlds. They compute the same numbers as sides without
// an account.
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
