#include "common/config/scene_kind.hpp"

#include <algorithm>
#include <limits>

#include "common/law/architectures.hpp"

namespace farhand {

bool is_elastic(const scene::Scene& scene) { return scene.slave().device() == scene::SERIES_ELASTIC; }
bool has_block(const scene::Scene& scene, std::string_view block) {
  const Architecture& laws = architecture(scene::Architecture_Name(scene.architecture()));
  return block_of(laws.master, block) != nullptr || block_of(laws.slave, block) != nullptr;
}
bool has_cdob(const scene::Scene& scene) { return has_block(scene, "CDOB"); }
bool is_mediated(const scene::Scene& scene) { return has_block(scene, "mediator"); }
bool has_sdcv(const scene::Scene& scene) { return has_block(scene, "SDCV"); }
bool has_passivity_controllers(const scene::Scene& scene) { return has_block(scene, "PO/PC"); }
bool is_two_channel(const scene::Scene& scene) {
  return has_block(scene, "two channels") && !has_passivity_controllers(scene);
}

double coarsest_counts(const scene::Scene& scene) {
  const auto or_ideal = [](double counts) { return counts > 0 ? counts : std::numeric_limits<double>::infinity(); };
  const scene::Slave& slave = scene.slave();
  return std::min(or_ideal(scene.master().motor().encoder_counts_per_rev()),
                  or_ideal(is_elastic(scene) ? slave.series_elastic().joint_counts_per_rev()
                                             : slave.motor().encoder_counts_per_rev()));
}

double default_g_v(const scene::Scene& scene) {
  // Of a scene that is not checked yet: it may name no architecture.
  const Architecture* laws = find_architecture(scene::Architecture_Name(scene.architecture()));
  const bool mediated = laws != nullptr && block_of(laws->master, "mediator") != nullptr;
  return mediated && coarsest_counts(scene) < 10000 ? 200.0 : 500.0;
}

Scale scale_of(const scene::Scene& scene) { return {scene.control().position_scale(), scene.control().force_scale()}; }
double master_K_f(const scene::Scene& scene) {
  const auto [position, force] = scale_of(scene);
  return scene.control().k_f_per_kgm2() / (position * force);
}

}  // namespace farhand
