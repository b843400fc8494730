#include "common/plant/world_engine.hpp"

namespace farhand {

std::unique_ptr<WorldEngine<MasterPlant::Truth>> make_engine(const MasterPlant::Params& params,
                                                             const WorldNumerics& numerics) {
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return make_engine_of<MasterPlantWith<Friction::kCoulomb>>(params, numerics);
    case Friction::kBristle:
      return make_engine_of<MasterPlantWith<Friction::kBristle>>(params, numerics);
    case Friction::kNone:
      break;
  }
  return make_engine_of<MasterPlant>(params, numerics);
}

}  // namespace farhand
