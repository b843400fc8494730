// Estimates the parameters of the axis in a recording: inertia, friction, weight; of the orthosis also its spring.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>

#include "common/config/json.hpp"
#include "common/identify/judgement.hpp"
#include "common/record/session_file.hpp"
#include "proto/scene.pb.h"

namespace farhand {

enum class IdentifiedSide { kMaster, kSlave, kOrthosis };

struct Identified {
  IdentifiedSide side = IdentifiedSide::kMaster;
  scene::Scene scene;  // that of the recording
  AxisModel said;      // by the scene
  double said_spring = 0.0;
  FreeMotionEstimate axis;
  Misfit axis_misfit = Misfit::kNone;
  std::optional<SpringEstimate> spring;  // of the orthosis
  Misfit spring_misfit = Misfit::kNone;
  std::optional<Estimate> torque_scale;  // if an inertia was given
};

// Known inertias, which separate the torque constant from the inertia.
struct KnownInertia {
  std::optional<double> own_kgm2;
  std::string loaded;  // recording with an inertia added
  double added_kgm2 = 0.0;
};

// side: master, slave, mcu, or empty if the recording holds one side, or one that was led for identification. Throws
// std::runtime_error or std::invalid_argument with a sentence if the recording cannot be read or lacks needed data.
Identified identify_recording(const std::string& file, const std::string& side, const KnownInertia& known = {});

// True if the requested estimate was found: the axis, or else the spring.
bool accepted(const Identified& found);
void print_identified(const Identified& found, std::ostream& out);
Json json_of(const Identified& found);

}  // namespace farhand
