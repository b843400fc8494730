#include "slave/emulator_params.hpp"
#include "tests/lab/bare_side.hpp"

namespace farhand {
namespace {

template <class T, class P>
std::unique_ptr<BareSide<T>> direct(const scene::Scene& scene, const BareChoice& choice, const P& plant) {
  using Law = std::conditional_t<std::same_as<T, double>, BlockLaw<FourChannel>, PlainLaw<PlainScene::kFourChannel, T>>;
  if constexpr (std::same_as<T, double>) {
    if (choice.method == BareMethod::kWorld) {
      using Side = DirectSide<Law, Held, WorldSolver<DirectSlaveWorld>>;
      return std::make_unique<BareSideOf<Side>>(
          Side(slave_station_params(scene, 2).scene, {},
               WorldSolver<DirectSlaveWorld>(DirectSlaveWorld(direct_slave_world_params(scene), world_numerics(scene))),
               {}, 0));
    }
  }
  return with_solver<T>(plant, choice, [&](auto held, auto solver) -> std::unique_ptr<BareSide<T>> {
    using Side = DirectSide<Law, decltype(held), decltype(solver)>;
    typename decltype(solver)::State start{};
    return std::make_unique<BareSideOf<Side>>(Side(slave_station_params(scene, 2).scene, held, std::move(solver), start,
                                                   scene.slave().motor().encoder_counts_per_rev()));
  });
}

template <class T, class P>
std::unique_ptr<BareSide<T>> elastic(const scene::Scene& scene, const BareChoice& choice, const P& plant) {
  if constexpr (std::same_as<T, double>) {
    if (choice.method == BareMethod::kWorld) {
      using Side = OrthosisSide<double, Held, WorldSolver<SeriesElasticWorld>>;
      mcu::McuSettings loops = emulator_params(scene).mcu;
      loops.joint_counts_per_rev = loops.motor_counts_per_rev = 0;  // the world reads its encoders itself
      return std::make_unique<BareSideOf<Side>>(Side(slave_station_params(scene, 2).scene, loops, {},
                                                     WorldSolver<SeriesElasticWorld>(SeriesElasticWorld(
                                                         series_elastic_world_params(scene), world_numerics(scene))),
                                                     {}));
    }
  }
  return with_solver<T>(plant, choice, [&](auto held, auto solver) -> std::unique_ptr<BareSide<T>> {
    using Side = OrthosisSide<T, decltype(held), decltype(solver)>;
    typename decltype(solver)::State start{};
    return std::make_unique<BareSideOf<Side>>(
        Side(slave_station_params(scene, 2).scene, emulator_params(scene).mcu, held, std::move(solver), start));
  });
}

}  // namespace

template <class T>
std::unique_ptr<BareSide<T>> make_bare_slave(const scene::Scene& scene, const BareChoice& choice) {
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    const SeriesElasticPlant::Params params = series_elastic_world_params(scene);
    if (params.friction() == Friction::kBristle)
      return elastic<T>(scene, choice, SeriesElasticPlantWith<Friction::kBristle>(params));
    return elastic<T>(scene, choice, SeriesElasticPlant(params));
  }
  const DirectSlavePlant::Params params = direct_slave_world_params(scene);
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return direct<T>(scene, choice, DirectSlavePlantWith<Friction::kCoulomb>(params));
    case Friction::kBristle:
      return direct<T>(scene, choice, DirectSlavePlantWith<Friction::kBristle>(params));
    case Friction::kNone:
      break;
  }
  return direct<T>(scene, choice, DirectSlavePlant(params));
}

template std::unique_ptr<BareSide<double>> make_bare_slave(const scene::Scene&, const BareChoice&);
template std::unique_ptr<BareSide<long double>> make_bare_slave(const scene::Scene&, const BareChoice&);

}  // namespace farhand
