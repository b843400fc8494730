// One session of a rogue peer against one real side, in virtual time: the station with its device and its person, and a
// peer made from a genome. Packets are not sealed, because a peer with the key could seal them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "netem/lab/rogue_judge.hpp"
#include "netem/lab/rogue_plan.hpp"
#include "proto/scene.pb.h"

namespace farhand::rogue {

enum class Device : std::uint8_t { kDirect, kMcu, kLyingMcu };

// A cell of the search: the endangered person, the law and the device.
struct Cell {
  Against against = Against::kPatient;
  scene::Architecture architecture = scene::FOUR_CHANNEL;
  Device device = Device::kDirect;
  bool operator==(const Cell&) const = default;
};

// patient/WAVE/mcu, therapist/MODEL_MEDIATED/direct, ...
std::string name_of(const Cell& cell);
// Throws std::invalid_argument with the names of the cells.
Cell cell_of(const std::string& name);
std::vector<Cell> all_cells();

struct Outcome {
  Findings findings;
  double engaged_s = 0, lasted_s = 0;
  double ratio() const noexcept;  // the largest of the lines with a bound; above 1 one is crossed
  Line worst() const noexcept;
};

// The limits for a session of this plan. The scene is the one that the plan makes.
Allowed allowed_of(const scene::Scene& scene, const Cell& cell, const Plan& plan);

// Runs sessions in a cell. A test changes its scene (for example a limit) by `sets`.
class Arena {
 public:
  // longer: the attack lasts this many times as long as its genome says.
  explicit Arena(const Cell& cell, const std::vector<std::string>& sets = {}, double longer = 1);

  const Cell& cell() const noexcept { return cell_; }
  Plan plan_of(const Genome& genome) const;
  scene::Scene scene_of(const Plan& plan) const;
  Outcome run(const Genome& genome) const;

 private:
  Cell cell_;
  scene::Scene scene_;
  double longer_;
};

}  // namespace farhand::rogue
