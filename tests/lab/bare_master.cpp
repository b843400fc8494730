#include "tests/lab/bare_solver.hpp"

namespace farhand {

template <class T>
std::unique_ptr<BarePlant<T>> make_bare_master(const scene::Scene& scene, const BareChoice& choice) {
  const MasterPlant::Params params = master_world_params(scene);
  if constexpr (std::same_as<T, double>) {
    if (!is_cvode(choice.method))
      return std::make_unique<WorldPlant<MasterWorld>>(MasterWorld(params, numerics_of(scene, choice)));
  }
  const EncoderCounts counts{params.motor.encoder_counts_per_rev, 0};
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return solved<T>(MasterPlantWith<Friction::kCoulomb>(params), choice, counts);
    case Friction::kBristle:
      return solved<T>(MasterPlantWith<Friction::kBristle>(params), choice, counts);
    case Friction::kNone:
      break;
  }
  return solved<T>(MasterPlant(params), choice, counts);
}

template std::unique_ptr<BarePlant<double>> make_bare_master(const scene::Scene&, const BareChoice&);
template std::unique_ptr<BarePlant<long double>> make_bare_master(const scene::Scene&, const BareChoice&);

}  // namespace farhand
