#include "common/plant/world_engine.hpp"

namespace farhand {

std::unique_ptr<WorldEngine<DirectSlavePlant::Truth>> make_engine(const DirectSlavePlant::Params& params,
                                                                  const WorldNumerics& numerics) {
  switch (params.motor.friction()) {
    case Friction::kCoulomb:
      return make_engine_of<DirectSlavePlantWith<Friction::kCoulomb>>(params, numerics);
    case Friction::kBristle:
      return make_engine_of<DirectSlavePlantWith<Friction::kBristle>>(params, numerics);
    case Friction::kNone:
      break;
  }
  return make_engine_of<DirectSlavePlant>(params, numerics);
}

}  // namespace farhand
