#include "common/config/scene_kind.hpp"

namespace farhand {

bool is_elastic(const scene::Scene& scene) { return scene.slave().device() == scene::SERIES_ELASTIC; }
bool has_cdob(const scene::Scene& scene) {
  return scene.architecture() == scene::FOUR_CHANNEL_CDOB || scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV;
}
bool chooses(const scene::Scene& scene) { return scene.architecture() == scene::AUTOMATIC; }
bool is_mediated(const scene::Scene& scene) { return scene.architecture() == scene::MODEL_MEDIATED || chooses(scene); }
bool has_sdcv(const scene::Scene& scene) { return scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV; }
bool is_two_channel(const scene::Scene& scene) { return scene.architecture() == scene::TWO_CHANNEL; }
bool is_wave(const scene::Scene& scene) { return scene.architecture() == scene::WAVE; }
bool has_tanks(const scene::Scene& scene) { return scene.architecture() == scene::FOUR_CHANNEL_TANK; }
bool has_passivity_controllers(const scene::Scene& scene) { return scene.architecture() == scene::TWO_CHANNEL_PO_PC; }

Scale scale_of(const scene::Scene& scene) { return {scene.control().position_scale(), scene.control().force_scale()}; }
double master_K_f(const scene::Scene& scene) {
  const auto [position, force] = scale_of(scene);
  return scene.control().k_f_per_kgm2() / (position * force);
}

}  // namespace farhand
