#include "common/plant/world_engine.hpp"

namespace farhand {

std::unique_ptr<WorldEngine<SeriesElasticPlant::Truth>> make_engine(const SeriesElasticPlant::Params& params,
                                                                    const WorldNumerics& numerics) {
  if (params.friction() == Friction::kBristle)
    return make_engine_of<SeriesElasticPlantWith<Friction::kBristle>>(params, numerics);
  return make_engine_of<SeriesElasticPlant>(params, numerics);
}

}  // namespace farhand
