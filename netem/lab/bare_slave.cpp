#include "netem/lab/bare_solver.hpp"

namespace farhand {
namespace {

template <class T>
std::unique_ptr<BarePlant<T>> direct(const scene::Scene& scene, const BareChoice& choice) {
  const DirectSlavePlant::Params params = direct_slave_world_params(scene);
  if constexpr (std::same_as<T, double>) {
    if (!is_cvode(choice.method))
      return std::make_unique<WorldPlant<DirectSlaveWorld>>(DirectSlaveWorld(params, numerics_of(scene, choice)));
  }
  return solved_axis<T, DirectSlavePlantWith>(params, choice);
}

template <class T>
std::unique_ptr<BarePlant<T>> elastic(const scene::Scene& scene, const BareChoice& choice) {
  const SeriesElasticPlant::Params params = series_elastic_world_params(scene);
  if constexpr (std::same_as<T, double>) {
    if (!is_cvode(choice.method))
      return std::make_unique<WorldPlant<SeriesElasticWorld>>(SeriesElasticWorld(params, numerics_of(scene, choice)));
  }
  const scene::SeriesElastic& device = scene.slave().series_elastic();
  const EncoderCounts counts{device.joint_counts_per_rev(), device.motor_counts_per_rev()};
  if (params.friction() == Friction::kBristle)
    return solved<T>(SeriesElasticPlantWith<Friction::kBristle>(params), choice, counts);
  return solved<T>(SeriesElasticPlant(params), choice, counts);
}

}  // namespace

template <class T>
std::unique_ptr<BarePlant<T>> make_bare_slave(const scene::Scene& scene, const BareChoice& choice) {
  return scene.slave().device() == scene::SERIES_ELASTIC ? elastic<T>(scene, choice) : direct<T>(scene, choice);
}

template std::unique_ptr<BarePlant<double>> make_bare_slave(const scene::Scene&, const BareChoice&);
template std::unique_ptr<BarePlant<long double>> make_bare_slave(const scene::Scene&, const BareChoice&);

}  // namespace farhand
