// Lists the blocks of a scene and those that it leaves out, with reasons and costs. The reasons contain the scene's own
// values; the times are measured within the call, on the scene's own motion.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "common/config/load.hpp"

namespace farhand {

enum class BlockId : std::uint8_t {
  kVelocity,
  kDob,
  kRtob,
  kWeight,
  kCoulomb,
  kLaw,
  kLawBlock,  // one of the law of a side, by its name
  kScale,
  kTorqueGate,
  kReferenceGate,
  kBlend,
  kEngagement,
  kGuard,
  kReceiver,
  kPlayoutDepth,
  kCodec,
  kDelay,
  kJitter,
  kLoss,
  kClock,
  kSerial,
  kMcu,
  kPlant,
  kSpring,
  kHand,
  kWall,
  kFriction,
  kPlantWeight,
  kEvents,
  kStiff,
  kRecording,
};

// Measured: differs from call to call. NaN: not measured.
struct Cost {
  double ns_per_tick = std::numeric_limits<double>::quiet_NaN();  // median of batches
  double low = std::numeric_limits<double>::quiet_NaN();          // quartiles
  double high = std::numeric_limits<double>::quiet_NaN();
};

enum class Place : std::uint8_t { kMaster, kSlave, kLink, kWorldMaster, kWorldSlave, kRun };

struct Block {
  Place place;
  BlockId id;
  std::string name;
  bool contained = false;
  std::string reason;      // why it is there, or why not
  std::string needless{};  // contained, but not needed by this scene: how to leave it out
  std::size_t bytes = 0;   // 0: no memory of its own
  Cost cost{};
};

// The integrator of a simulated world.
struct PlantChoice {
  std::string plant;   // master or slave
  std::string asked;   // by the scene
  std::string method;  // what runs
  double step_s = 0;
  double largest_rate_per_s = 0;  // largest |lambda| of all modes
  double rate_times_step = 0;
  double limit = 0;     // beyond which an explicit method diverges
  std::string because;  // in words
};

// The object that an architecture is on one side.
struct LawSize {
  std::string_view name, source;
  std::size_t bytes = 0, of_blocks = 0;
  Cost cost{};
};

struct Explanation {
  std::string scene;
  std::vector<Block> blocks;
  std::vector<PlantChoice> plants;
  std::size_t master_station_bytes = 0, slave_station_bytes = 0;
  std::size_t master_side_bytes = 0, slave_side_bytes = 0;  // with the simulated device
  LawSize master_law, slave_law;
  Cost master_station, slave_station, master_side, slave_side, run;
};

// Without costs: the same every time.
Explanation explain_without_costs(const LoadedScene& loaded);
Explanation explain(const LoadedScene& loaded);

const char* name_of(Place place);

}  // namespace farhand
