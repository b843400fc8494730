#include "tests/lab/explain_plants.hpp"

#include <sstream>

#include "common/config/world_params.hpp"
#include "common/integrate/closed_form.hpp"
#include "common/integrate/integrator.hpp"
#include "common/plant/world_method.hpp"

namespace farhand {
namespace {

template <class... Parts>
std::string say(const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return text.str();
}

template <class P>
std::size_t solver_bytes(Method method) {
  if (method != Method::kClosedForm) return sizeof(Integrator<Rk4, P>);
  if constexpr (AffinePlant<P>) return sizeof(ClosedForm<P>);
  return 0;
}

struct About {
  PlantChoice choice;
  std::size_t plant_bytes, solver_bytes;
};

template <class P>
About about(const char* name, const typename P::Params& params, const WorldNumerics& numerics) {
  const P plant(params);
  const double step = numerics.settings.max_step;
  const bool automatic = numerics.method == Method::kAuto;
  const Method method = automatic ? auto_method(plant, step) : numerics.method;
  PlantChoice c;
  c.plant = name;
  c.asked = name_of(numerics.method);
  c.method = name_of(method);
  c.step_s = step;
  c.largest_rate_per_s = plant.fastest_rate();
  c.rate_times_step = c.largest_rate_per_s * step;
  c.limit = kRk4StableRadius;
  const std::string estimate =
      say("largest |lambda| ", c.largest_rate_per_s, " 1/s, times the step of ", 1e6 * step, " us ", c.rate_times_step);
  const char* not_affine = plant.not_affine();
  if (!automatic) {
    c.because = say("world.method asks for it; ", estimate, ", limit of RK4 ", c.limit);
  } else if (not_affine == nullptr) {
    c.because = say("affine in every mode, so exact at any rate; ", estimate, ", limit of RK4 ", c.limit);
  } else {
    c.because = say(method == Method::kRk4 ? "not stiff: " : "stiff: ", estimate,
                    method == Method::kRk4 ? ", below" : ", above", " the limit of RK4 ", c.limit,
                    "; no closed form: ", not_affine);
  }
  return {c, sizeof(P), solver_bytes<P>(method)};
}

// As the worlds are made: by their friction.
About about_master(const scene::Scene& scene) {
  const MasterPlant::Params p = master_world_params(scene);
  const WorldNumerics n = world_numerics(scene);
  if (p.motor.friction() == Friction::kCoulomb) return about<MasterPlantWith<Friction::kCoulomb>>("master", p, n);
  if (p.motor.friction() == Friction::kBristle) return about<MasterPlantWith<Friction::kBristle>>("master", p, n);
  return about<MasterPlant>("master", p, n);
}
About about_slave(const scene::Scene& scene) {
  const WorldNumerics n = world_numerics(scene);
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    const SeriesElasticPlant::Params p = series_elastic_world_params(scene);
    if (p.friction() == Friction::kBristle) return about<SeriesElasticPlantWith<Friction::kBristle>>("slave", p, n);
    return about<SeriesElasticPlant>("slave", p, n);
  }
  const DirectSlavePlant::Params p = direct_slave_world_params(scene);
  if (p.motor.friction() == Friction::kCoulomb) return about<DirectSlavePlantWith<Friction::kCoulomb>>("slave", p, n);
  if (p.motor.friction() == Friction::kBristle) return about<DirectSlavePlantWith<Friction::kBristle>>("slave", p, n);
  return about<DirectSlavePlant>("slave", p, n);
}

void add(Place place, const About& about, const std::string& contacts, Explanation& to) {
  for (Block& block : to.blocks) {
    if (block.place == place && block.id == BlockId::kPlant) block.bytes = about.plant_bytes + about.solver_bytes;
  }
  to.blocks.push_back({place, BlockId::kEvents, "event location", true, contacts});
  const bool stiff =
      about.choice.method == name_of(Method::kSdirk2) || about.choice.method == name_of(Method::kRosenbrock);
  to.blocks.push_back({place, BlockId::kStiff, "stiff integrator", stiff,
                       stiff ? about.choice.because
                       : about.choice.method == name_of(Method::kClosedForm)
                           ? std::string("the closed form is exact at any rate")
                           : say("not stiff: largest |lambda| times the step is ", about.choice.rate_times_step,
                                 ", RK4 does up to ", about.choice.limit)});
  to.plants.push_back(about.choice);
}

}  // namespace

void explain_plants(const scene::Scene& scene, Explanation& explanation) {
  const scene::Motor& m = scene.master().motor();
  add(Place::kWorldMaster, about_master(scene),
      say("the stops at ", m.stop_min_rad(), " and ", m.stop_max_rad(), " rad"), explanation);
  const bool elastic = scene.slave().device() == scene::SERIES_ELASTIC;
  const scene::SeriesElastic& e = scene.slave().series_elastic();
  const scene::Motor& n = scene.slave().motor();
  std::string contacts = say("the stops at ", elastic ? e.stop_min_rad() : n.stop_min_rad(), " and ",
                             elastic ? e.stop_max_rad() : n.stop_max_rad(), " rad");
  if (scene.slave().has_wall()) contacts += say(", the wall at ", scene.slave().wall().at_rad(), " rad");
  add(Place::kWorldSlave, about_slave(scene), contacts, explanation);
}

}  // namespace farhand
