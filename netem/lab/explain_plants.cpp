#include "netem/lab/explain_plants.hpp"

#include <complex>
#include <sstream>

#include "common/config/world_params.hpp"
#include "common/integrate/closed_form.hpp"
#include "common/integrate/integrator.hpp"
#include "common/plant/world.hpp"

namespace farhand {
namespace {

template <class... Parts>
std::string say(const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return text.str();
}

struct About {
  PlantChoice choice;
  std::size_t bytes;  // of the plant and of what advances it
};

// World: made of this plant.
template <class P, class World>
About about(const char* name, const World& world, const WorldNumerics& numerics) {
  const MethodChoice& choice = world.choice();
  PlantChoice c;
  c.plant = name;
  c.asked = name_of(numerics.method);
  c.method = name_of(world.method());
  c.step_s = numerics.settings.max_step;
  c.largest_rate_per_s = std::abs(choice.eigenvalue);
  c.rate_times_step = choice.rate_times_step;
  c.limit = choice.limit;
  const std::string estimate = say("largest |lambda| ", c.largest_rate_per_s, " 1/s, times the step of ",
                                   1e6 * c.step_s, " us ", c.rate_times_step);
  if (numerics.method != Method::kAuto) {
    c.because = say("world.method asks for it; ", estimate, ", limit of RK4 ", c.limit);
  } else if (choice.not_affine == nullptr) {
    c.because = say("affine in every mode, so exact at any rate; ", estimate, ", limit of RK4 ", c.limit);
  } else {
    const bool stiff = choice.rate_times_step > choice.limit;
    c.because = say(stiff ? "stiff: " : "not stiff: ", estimate, stiff ? ", above" : ", below", " the limit of RK4 ",
                    c.limit, "; no closed form: ", choice.not_affine);
  }
  std::size_t solver = sizeof(Integrator<Rk4, P>);
  if constexpr (AffinePlant<P>) {
    if (world.method() == Method::kClosedForm) solver = sizeof(ClosedForm<P>);
  }
  return {c, sizeof(P) + solver};
}

// By their friction, as the worlds are made.
About about_master(const scene::Scene& scene) {
  const MasterPlant::Params p = master_world_params(scene);
  const WorldNumerics n = world_numerics(scene);
  const MasterWorld world(p, n);
  if (p.motor.friction() == Friction::kCoulomb) return about<MasterPlantWith<Friction::kCoulomb>>("master", world, n);
  if (p.motor.friction() == Friction::kBristle) return about<MasterPlantWith<Friction::kBristle>>("master", world, n);
  return about<MasterPlant>("master", world, n);
}
About about_slave(const scene::Scene& scene) {
  const WorldNumerics n = world_numerics(scene);
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    const SeriesElasticPlant::Params p = series_elastic_world_params(scene);
    const SeriesElasticWorld world(p, n);
    if (p.friction() == Friction::kBristle) return about<SeriesElasticPlantWith<Friction::kBristle>>("slave", world, n);
    return about<SeriesElasticPlant>("slave", world, n);
  }
  const DirectSlavePlant::Params p = direct_slave_world_params(scene);
  const DirectSlaveWorld world(p, n);
  if (p.motor.friction() == Friction::kCoulomb)
    return about<DirectSlavePlantWith<Friction::kCoulomb>>("slave", world, n);
  if (p.motor.friction() == Friction::kBristle)
    return about<DirectSlavePlantWith<Friction::kBristle>>("slave", world, n);
  return about<DirectSlavePlant>("slave", world, n);
}

void add(Place place, const About& about, const std::string& contacts, Explanation& to) {
  for (Block& block : to.blocks) {
    if (block.place == place && block.id == BlockId::kPlant) block.bytes = about.bytes;
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
