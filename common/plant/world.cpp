#include "common/plant/world_engine.hpp"

namespace farhand {

std::unique_ptr<WorldEngine<MasterPlant::Truth>> make_engine(const MasterPlant::Params& params,
                                                             const WorldNumerics& numerics) {
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return std::make_unique<EngineOf<MasterPlantWith<Friction::kCoulomb>>>(params, numerics);
    case Friction::kBristle:
      return std::make_unique<EngineOf<MasterPlantWith<Friction::kBristle>>>(params, numerics);
    case Friction::kNone:
      break;
  }
  return std::make_unique<EngineOf<MasterPlant>>(params, numerics);
}
std::unique_ptr<WorldEngine<DirectSlavePlant::Truth>> make_engine(const DirectSlavePlant::Params& params,
                                                                  const WorldNumerics& numerics) {
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return std::make_unique<EngineOf<DirectSlavePlantWith<Friction::kCoulomb>>>(params, numerics);
    case Friction::kBristle:
      return std::make_unique<EngineOf<DirectSlavePlantWith<Friction::kBristle>>>(params, numerics);
    case Friction::kNone:
      break;
  }
  return std::make_unique<EngineOf<DirectSlavePlant>>(params, numerics);
}
std::unique_ptr<WorldEngine<SeriesElasticPlant::Truth>> make_engine(const SeriesElasticPlant::Params& params,
                                                                    const WorldNumerics& numerics) {
  if (params.friction() == Friction::kBristle)
    return std::make_unique<EngineOf<SeriesElasticPlantWith<Friction::kBristle>>>(params, numerics);
  return std::make_unique<EngineOf<SeriesElasticPlant>>(params, numerics);
}

}  // namespace farhand
