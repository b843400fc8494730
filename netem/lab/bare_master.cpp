#include "netem/lab/bare_solver.hpp"

namespace farhand {

template <class T>
std::unique_ptr<BarePlant<T>> make_bare_master(const scene::Scene& scene, const BareChoice& choice) {
  const MasterPlant::Params params = master_world_params(scene);
  if constexpr (std::same_as<T, double>) {
    if (!is_cvode(choice.method))
      return std::make_unique<WorldPlant<MasterWorld>>(MasterWorld(params, numerics_of(scene, choice)));
  }
  return solved_axis<T, MasterPlantWith>(params, choice);
}

template std::unique_ptr<BarePlant<double>> make_bare_master(const scene::Scene&, const BareChoice&);
template std::unique_ptr<BarePlant<long double>> make_bare_master(const scene::Scene&, const BareChoice&);

}  // namespace farhand
