#include "tests/lab/bare_side.hpp"

namespace farhand {
namespace {

template <class Law, class P>
auto side_of(const scene::Scene& scene, const BareChoice& choice, const P& plant)
    -> std::unique_ptr<BareSide<typename Law::Real>> {
  using T = typename Law::Real;
  if constexpr (std::same_as<T, double>) {
    if (choice.method == BareMethod::kWorld) {
      using Side = DirectSide<Law, Held, WorldSolver<MasterWorld>>;
      return std::make_unique<BareSideOf<Side>>(
          Side(master_station_params(scene, 1).scene, {},
               WorldSolver<MasterWorld>(MasterWorld(master_world_params(scene), world_numerics(scene))), {}, 0));
    }
  }
  return with_solver<T>(plant, choice, [&](auto held, auto solver) -> std::unique_ptr<BareSide<T>> {
    using Side = DirectSide<Law, decltype(held), decltype(solver)>;
    typename decltype(solver)::State start{};
    return std::make_unique<BareSideOf<Side>>(Side(master_station_params(scene, 1).scene, held, std::move(solver),
                                                   start, scene.master().motor().encoder_counts_per_rev()));
  });
}

template <class T, class P>
std::unique_ptr<BareSide<T>> with_law(const scene::Scene& scene, const BareChoice& choice, const P& plant) {
  if constexpr (std::same_as<T, double>) {
    if (scene.architecture() == scene::FOUR_CHANNEL_CDOB)
      return side_of<BlockLaw<FourChannelCdob>>(scene, choice, plant);
    if (scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV)
      return side_of<BlockLaw<FourChannelCdobSdcv>>(scene, choice, plant);
    return side_of<BlockLaw<FourChannel>>(scene, choice, plant);
  } else {
    if (scene.architecture() == scene::FOUR_CHANNEL_CDOB)
      return side_of<PlainLaw<PlainScene::kCdob, T>>(scene, choice, plant);
    if (scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV)
      return side_of<PlainLaw<PlainScene::kCdobSdcv, T>>(scene, choice, plant);
    return side_of<PlainLaw<PlainScene::kFourChannel, T>>(scene, choice, plant);
  }
}

}  // namespace

template <class T>
std::unique_ptr<BareSide<T>> make_bare_master(const scene::Scene& scene, const BareChoice& choice) {
  const MasterPlant::Params params = master_world_params(scene);
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return with_law<T>(scene, choice, MasterPlantWith<Friction::kCoulomb>(params));
    case Friction::kBristle:
      return with_law<T>(scene, choice, MasterPlantWith<Friction::kBristle>(params));
    case Friction::kNone:
      break;
  }
  return with_law<T>(scene, choice, MasterPlant(params));
}

template std::unique_ptr<BareSide<double>> make_bare_master(const scene::Scene&, const BareChoice&);
template std::unique_ptr<BareSide<long double>> make_bare_master(const scene::Scene&, const BareChoice&);

}  // namespace farhand
