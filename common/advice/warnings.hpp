// Warnings about scenes that will run badly: loops beyond their stability limit, settings that do not fit each other.
// Each sentence names the fields, their values and the bound. The bounds of loops are those of common/analysis for
// exactly this scene; the others are rules measured with these laws.
#pragma once

#include <string>
#include <vector>

#include "proto/scene.pb.h"

namespace farhand {

// The scene must be complete, as load_scene returns it.
std::vector<std::string> warnings(const scene::Scene& scene);

}  // namespace farhand
